// SPDX-License-Identifier: GPL-3.0-or-later
// Bakes three.js's own LightProbeGridWebGL in the scene of scene.json and scene.glb, as request.json asks, and posts
// times and the irradiance at nodes to /result.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { addLamp } from './viewer.js';

const json = async ( name ) => ( await fetch( name ) ).json();

async function measure() {

	const [ request, about ] = await Promise.all( [ json( 'request.json' ), json( 'scene.json' ) ] );
	const renderer = new THREE.WebGLRenderer();
	renderer.shadowMap.enabled = true;
	const context = renderer.getContext();
	const device = context.getExtension( 'WEBGL_debug_renderer_info' );
	const scene = new THREE.Scene();
	scene.background = new THREE.Color().setRGB( ...about.background );
	const model = ( await new GLTFLoader().loadAsync( about.model ) ).scene;
	model.traverse( ( object ) => { if ( object.isMesh ) object.castShadow = object.receiveShadow = true; } );
	scene.add( model );
	for ( const lamp of about.lamps ) addLamp( scene, lamp, about.radius );

	const wait = () => context.readPixels( 0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array( 4 ) );
	const runs = [], until = performance.now() + 1000 * request.seconds;
	for ( const options of request.settings ) {

		const grid = new LightProbeGridWebGL( ...request.size, ...request.resolution );
		grid.position.fromArray( request.center );
		const seconds = [];
		for ( const _ of [ 'first', 'again' ] ) {

			scene.add( grid );
			wait();
			const start = performance.now();
			grid.bake( renderer, scene, { near: 0.02, far: 2 * about.radius, ...options } );
			wait();
			seconds.push( ( performance.now() - start ) / 1000 );
			if ( performance.now() > until ) break;

		}

		runs.push( { options, seconds, irradiance: irradiance( renderer, grid, request ) } );
		scene.remove( grid );
		grid.dispose();
		if ( performance.now() + 1000 * seconds[ 0 ] > until ) break;

	}

	return {
		revision: THREE.REVISION, runs,
		device: context.getParameter( device ? device.UNMASKED_RENDERER_WEBGL : context.RENDERER ),
	};

}

// [node][normal][rgb]: what a white card sends, times pi. three.js looks half a cell along the normal before it
// interpolates, so the card is put that far behind the node.
function irradiance( renderer, grid, { nodes, normals, size, resolution } ) {

	const scene = new THREE.Scene();
	scene.add( grid );
	const card = new THREE.Mesh( new THREE.PlaneGeometry( 2e-3, 2e-3 ), new THREE.MeshLambertMaterial( { color: 0xffffff } ) );
	scene.add( card );
	const camera = new THREE.OrthographicCamera( - 5e-4, 5e-4, 5e-4, - 5e-4, 1e-3, 1 );
	const target = new THREE.WebGLRenderTarget( 1, 1, { type: THREE.FloatType } );
	const pixel = new Float32Array( 4 );
	const half = new THREE.Vector3().fromArray( size ).divide( new THREE.Vector3().fromArray( resolution ) ).divideScalar( 2 );
	renderer.setRenderTarget( target );
	const found = nodes.map( ( node ) => normals.map( ( normal ) => {

		const out = new THREE.Vector3().fromArray( normal );
		card.position.fromArray( node ).sub( out.clone().multiply( half ) );
		card.lookAt( card.position.clone().add( out ) );
		camera.up.set( ...( Math.abs( out.y ) > 0.9 ? [ 1, 0, 0 ] : [ 0, 1, 0 ] ) );
		camera.position.copy( card.position ).addScaledVector( out, 0.01 );
		camera.lookAt( card.position );
		renderer.render( scene, camera );
		renderer.readRenderTargetPixels( target, 0, 0, 1, 1, pixel );
		return [ ...pixel.slice( 0, 3 ) ].map( ( value ) => value * Math.PI );

	} ) );
	renderer.setRenderTarget( null );
	scene.remove( grid );
	return found;

}

measure().then( ( result ) => result, ( error ) => ( { error: `${ error }` } ) )
	.then( ( result ) => fetch( '/result', { method: 'POST', body: JSON.stringify( result ) } ) );
