// SPDX-License-Identifier: GPL-3.0-or-later
// read_exr.mjs FILE: its pixels as three.js's EXRLoader finds them, which is no relative of OpenEXR.
import { readFileSync } from 'node:fs';
import { FloatType } from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

const bytes = readFileSync( process.argv[ 2 ] );
const loader = new EXRLoader().setDataType( FloatType );
const image = loader.parse( bytes.buffer.slice( bytes.byteOffset, bytes.byteOffset + bytes.byteLength ) );
console.log( JSON.stringify( { width: image.width, height: image.height, pixels: [ ...image.data ] } ) );
