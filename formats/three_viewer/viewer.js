// SPDX-License-Identifier: MIT-0
// The viewer: probes, the scene's GLB and lamps, orbit controls. What it shows is also in window.gridlight, for tests
// and for the console: { renderer, scene, camera, controls, grid, lamps, model, render }.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';
import { LightProbeGridHelperWebGL } from 'three/addons/helpers/LightProbeGridHelperWebGL.js';
import { loadProbeGrid } from './gridlight-probes.js';

export async function start( form ) {

	const renderer = new THREE.WebGLRenderer( { antialias: true } );
	renderer.setPixelRatio( devicePixelRatio );
	renderer.shadowMap.enabled = true;
	renderer.toneMapping = THREE.LinearToneMapping; // exposure and the sRGB curve: Blender's Standard view
	document.body.prepend( renderer.domElement );

	const scene = new THREE.Scene();
	const camera = new THREE.PerspectiveCamera( 50, 1, 0.02, 1000 );
	const controls = new OrbitControls( camera, renderer.domElement );

	const grid = await loadProbeGrid( 'probes.json', LightProbeGridWebGL );
	scene.add( grid );
	const spheres = probeSpheres( grid );
	scene.add( spheres );

	const lamps = new THREE.Group();
	scene.add( lamps );
	const about = await sceneDescription();
	const model = about ? ( await new GLTFLoader().loadAsync( about.model ) ).scene : stage( grid );
	scene.add( model );
	model.traverse( ( object ) => { if ( object.isMesh ) object.castShadow = object.receiveShadow = true; } );
	if ( about ) {

		for ( const lamp of about.lamps ) addLamp( lamps, lamp, about.radius );
		scene.background = new THREE.Color().setRGB( ...about.background );
		form.exposure.value = about.exposure;

	}

	look( camera, controls, grid, about?.camera );
	const white = new THREE.MeshLambertMaterial( { color: 0xffffff, side: THREE.DoubleSide } );

	const render = () => renderer.render( scene, camera );
	const apply = () => {

		grid.visible = form.probes.checked;
		lamps.visible = form.lamps.checked;
		spheres.visible = form.spheres.checked;
		scene.overrideMaterial = form.white.checked ? white : null;
		renderer.toneMappingExposure = 2 ** form.exposure.value;
		form.querySelector( 'output' ).value = form.exposure.value;
		render();

	};
	const resize = () => {

		camera.aspect = innerWidth / innerHeight;
		camera.fov = 2 * Math.atan( camera.userData.halfWidth / camera.aspect ) * 180 / Math.PI;
		camera.updateProjectionMatrix();
		renderer.setSize( innerWidth, innerHeight );
		render();

	};
	form.addEventListener( 'input', apply );
	controls.addEventListener( 'change', render );
	addEventListener( 'resize', resize );
	resize();
	apply();
	window.gridlight = { THREE, renderer, scene, camera, controls, grid, lamps, spheres, model, render };

}

// scene.json as an export with --scene writes it, or null where there is none.
async function sceneDescription() {

	const response = await fetch( 'scene.json' );
	if ( response.status === 404 ) return null;
	if ( ! response.ok ) throw new Error( `scene.json cannot be loaded: ${ response.status } ${ response.statusText }` );
	return response.json();

}

// Something to see the light on where there is no scene: one ball in every few cells.
function stage( grid ) {

	const size = grid.boundingBox.getSize( new THREE.Vector3() );
	const step = Math.cbrt( size.x * size.y * size.z / 64 );
	const counts = size.clone().divideScalar( step ).round().clampScalar( 1, 12 );
	const balls = new THREE.InstancedMesh(
		new THREE.SphereGeometry( 0.3 * step, 32, 16 ), new THREE.MeshLambertMaterial( { color: 0xffffff } ),
		counts.x * counts.y * counts.z );
	const place = new THREE.Vector3(), matrix = new THREE.Matrix4();
	for ( let i = 0; i < balls.count; i ++ ) {

		place.set( i % counts.x, Math.floor( i / counts.x ) % counts.y, Math.floor( i / ( counts.x * counts.y ) ) );
		place.addScalar( 0.5 ).divide( counts ).multiply( size ).add( grid.boundingBox.min );
		balls.setMatrixAt( i, matrix.makeTranslation( place ) );

	}

	return balls;

}

function probeSpheres( grid ) {

	const spacing = grid.boundingBox.getSize( new THREE.Vector3() ).divide( grid.resolution );
	const spheres = new LightProbeGridHelperWebGL( grid, 0.08 * Math.min( spacing.x, spacing.y, spacing.z ) );
	spheres.visible = false;
	return spheres;

}

// Points, spots and suns carry over exactly. three.js casts no shadows from area lights, so a spot of the same power
// stands in for one: its cone falls off about as the cosine of a flat lamp does. Direct light here is a sketch; light from probes is not.
export function addLamp( group, lamp, radius ) {

	const color = new THREE.Color().setRGB( ...lamp.color );
	let light;
	if ( lamp.kind === 'point' ) light = new THREE.PointLight( color, 1 );
	else if ( lamp.kind === 'sun' ) light = new THREE.DirectionalLight( color, 1 );
	else light = new THREE.SpotLight( color, 1, 0, lamp.angle, lamp.blend );
	light.position.fromArray( lamp.position );
	if ( lamp.kind === 'sun' ) {

		light.position.fromArray( lamp.direction ).multiplyScalar( - radius );
		Object.assign( light.shadow.camera, { left: - radius, right: radius, top: radius, bottom: - radius, far: 2 * radius } );

	}

	if ( light.target ) {

		light.target.position.copy( light.position ).add( new THREE.Vector3().fromArray( lamp.direction ) );
		group.add( light.target );

	}

	light.castShadow = lamp.shadow;
	light.shadow.mapSize.set( 2048, 2048 );
	light.shadow.normalBias = 0.04;
	light.shadow.bias = - 0.0005;
	light.shadow.camera.near = 0.05;
	group.add( light );

}

function look( camera, controls, grid, view ) {

	const box = grid.boundingBox;
	const center = box.getCenter( new THREE.Vector3() ), size = box.getSize( new THREE.Vector3() );
	camera.userData.halfWidth = view ? view.half_width : 0.75;
	if ( view ) {

		camera.position.fromArray( view.position );
		controls.target.fromArray( view.forward ).multiplyScalar( 0.5 * size.length() ).add( camera.position );

	} else {

		camera.position.copy( size ).multiplyScalar( 0.9 ).add( center );
		controls.target.copy( center );

	}

	controls.update();

}
