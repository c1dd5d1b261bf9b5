// SPDX-License-Identifier: GPL-3.0-or-later
// Added to the viewer's page by the tests: renders the scene white, lit by probes alone, and hands every pixel's place,
// normal and irradiance back. window.gridlight is what viewer.js leaves there.
async function measure() {

	for ( let wait = 0; ! window.gridlight; wait ++ ) {

		const message = document.getElementById( 'message' );
		if ( wait > 600 || ( message && ! message.textContent.startsWith( 'Loading' ) ) ) throw new Error( message?.textContent );
		await new Promise( ( resolve ) => setTimeout( resolve, 100 ) );

	}

	const { THREE, renderer, scene, camera, grid, lamps, spheres } = window.gridlight;
	const size = 128, rows = [];
	const target = new THREE.WebGLRenderTarget( size, size, { type: THREE.FloatType, samples: 0 } );
	const geometryMaterial = ( output ) => new THREE.ShaderMaterial( {
		side: THREE.DoubleSide,
		vertexShader: `varying vec3 place, facing;
			void main() {
				mat4 model = modelMatrix;
				#ifdef USE_INSTANCING
				model = modelMatrix * instanceMatrix;
				#endif
				place = ( model * vec4( position, 1.0 ) ).xyz;
				facing = mat3( transpose( inverse( model ) ) ) * normal;
				gl_Position = projectionMatrix * viewMatrix * vec4( place, 1.0 );
			}`,
		fragmentShader: `varying vec3 place, facing;
			void main() { gl_FragColor = vec4( ${ output }, 1.0 ); }`,
	} );
	const passes = {
		place: geometryMaterial( 'place' ),
		normal: geometryMaterial( 'normalize( facing ) * ( gl_FrontFacing ? 1.0 : - 1.0 )' ),
		light: new THREE.MeshLambertMaterial( { color: 0xffffff, side: THREE.DoubleSide } ),
	};
	lamps.visible = spheres.visible = false;
	grid.visible = true;
	scene.background = null;
	camera.aspect = 1;
	camera.updateProjectionMatrix();

	const read = ( material ) => {

		scene.overrideMaterial = material;
		renderer.setRenderTarget( target );
		renderer.setClearColor( 0, 0 );
		renderer.clear();
		renderer.render( scene, camera );
		const pixels = new Float32Array( 4 * size * size );
		renderer.readRenderTargetPixels( target, 0, 0, size, size, pixels );
		return pixels;

	};

	const center = grid.boundingBox.getCenter( new THREE.Vector3() );
	const reach = grid.boundingBox.getSize( new THREE.Vector3() ).multiplyScalar( MEASURE.reach );
	for ( const view of [ [ 1, 0.6, 0.9 ], [ - 0.8, 0.7, - 1 ], [ 0.3, - 0.9, 0.5 ], [ - 1, - 0.4, 0.2 ] ] ) {

		camera.position.fromArray( view ).multiply( reach ).add( center );
		camera.lookAt( center );
		camera.updateMatrixWorld();
		const found = Object.fromEntries( Object.entries( passes ).map( ( [ name, material ] ) => [ name, read( material ) ] ) );
		for ( let pixel = 0; pixel < size * size; pixel += 7 ) {

			if ( found.place[ 4 * pixel + 3 ] === 0 ) continue;
			rows.push( Object.values( found ).flatMap( ( pixels ) => [ ...pixels.slice( 4 * pixel, 4 * pixel + 3 ) ] ) );

		}

	}

	return { revision: THREE.REVISION, renderer: renderer.getContext().getParameter( renderer.getContext().VERSION ), rows };

}

measure().then( ( result ) => result, ( error ) => ( { error: `${ error }` } ) )
	.then( ( result ) => fetch( '/result', { method: 'POST', body: JSON.stringify( result ) } ) );
