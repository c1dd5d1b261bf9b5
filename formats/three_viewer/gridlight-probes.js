// SPDX-License-Identifier: MIT-0
// Loads probes.json and its atlas into a LightProbeGrid of three.js r184 or later.
//
//   import { LightProbeGridWebGL } from 'three/addons/lighting/LightProbeGridWebGL.js';   // with WebGLRenderer
//   import { loadProbeGrid } from './gridlight-probes.js';
//   scene.add( await loadProbeGrid( 'probes.json', LightProbeGridWebGL ) );
//
// With WebGPURenderer take LightProbeGrid from 'three/addons/lighting/LightProbeGrid.js' instead (r184 and r185 have
// only that one file, for WebGLRenderer).
import { Data3DTexture, FloatType, HalfFloatType, LinearFilter, REVISION } from 'three';

export async function loadProbeGrid( url, Grid ) {

	const place = new URL( url, document.baseURI );
	const about = await ( await get( place ) ).json();
	if ( about.format !== 'gridlight-three' || about.version !== 1 ) throw new Error( `${ url } is not a Gridlight atlas of version 1` );
	const bytes = await ( await get( new URL( about.atlas, place ) ) ).arrayBuffer();

	const half = about.type === 'half';
	const texture = new Data3DTexture( half ? new Uint16Array( bytes ) : new Float32Array( bytes ), ...about.atlas_size );
	texture.type = half ? HalfFloatType : FloatType;
	texture.minFilter = texture.magFilter = LinearFilter;
	texture.needsUpdate = true;

	// Up to r186 the box of a grid ends at the outermost probes, from r187 on half a cell beyond them.
	const size = parseInt( REVISION ) >= 187 ? about.size : about.probe_extent;
	const grid = new Grid( ...size, ...about.resolution );
	grid.position.fromArray( about.center );
	grid.updateBoundingBox();
	grid.texture = texture;
	return grid;

}

async function get( url ) {

	const response = await fetch( url );
	if ( ! response.ok ) throw new Error( `${ url } cannot be loaded: ${ response.status } ${ response.statusText }` );
	return response;

}
