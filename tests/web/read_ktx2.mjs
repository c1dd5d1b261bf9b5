// SPDX-License-Identifier: GPL-3.0-or-later
// read_ktx2.mjs FILE: what ktx-parse finds in it.
import { readFileSync } from 'node:fs';
import { read } from 'ktx-parse';

const file = read( new Uint8Array( readFileSync( process.argv[ 2 ] ) ) );
const [ descriptor ] = file.dataFormatDescriptor;
console.log( JSON.stringify( {
	format: file.vkFormat, typeSize: file.typeSize, size: [ file.pixelWidth, file.pixelHeight, file.pixelDepth ],
	layers: file.layerCount, faces: file.faceCount, compression: file.supercompressionScheme,
	levels: file.levels.map( ( level ) => Buffer.from( level.levelData ).toString( 'base64' ) ),
	writer: file.keyValue.KTXwriter,
	model: descriptor.colorModel, primaries: descriptor.colorPrimaries, transfer: descriptor.transferFunction,
	bytes: descriptor.bytesPlane[ 0 ], samples: descriptor.samples,
} ) );
