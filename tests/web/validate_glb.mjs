// SPDX-License-Identifier: GPL-3.0-or-later
// validate_glb.mjs FILE: the report of Khronos' glTF validator.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

console.log( JSON.stringify( await validator.validateBytes( new Uint8Array( readFileSync( process.argv[ 2 ] ) ) ) ) );
