// SPDX-License-Identifier: GPL-3.0-or-later
// read_light_probe.mjs FILE X Y Z …: irradiance of the LightProbe that three.js's ObjectLoader makes of it, by normal.
import { readFileSync } from 'node:fs';
import { ObjectLoader, Vector3 } from 'three';

const probe = new ObjectLoader().parse( JSON.parse( readFileSync( process.argv[ 2 ] ) ) );
const numbers = process.argv.slice( 3 ).map( Number );
const irradiance = [];
for ( let i = 0; i < numbers.length; i += 3 ) {

	const found = probe.sh.getIrradianceAt( new Vector3( ...numbers.slice( i, i + 3 ) ), new Vector3() );
	irradiance.push( found.toArray() );

}

console.log( JSON.stringify( { type: probe.type, position: probe.position.toArray(), irradiance } ) );
