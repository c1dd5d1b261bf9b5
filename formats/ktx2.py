# SPDX-License-Identifier: GPL-3.0-or-later
"""KTX 2.0 files of uncompressed float volumes (Khronos Texture 2.0 specification; Data Format specification 1.3).

::

    0    identifier                     12 bytes
    12   header                         9 × uint32
    48   index of the parts below       4 × uint32, 2 × uint64
    80   level index: offset, length    3 × uint64
    104  data format descriptor         4 + 24 + 16 per channel
    196  key/value data                 length, "key\\0value\\0", padding to 4
         texels, aligned to their size  x fastest, then y, then z
"""

from __future__ import annotations

import struct

import numpy as np

from .probe_metadata import program_version

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"
_FORMATS = {2: 97, 4: 109}  # bytes a channel: VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT
_RGBSDA, _BT709, _LINEAR, _ALPHA = 1, 1, 1, 15
_SIGNED_FLOAT = 0xC0
_DESCRIPTOR_OFFSET = 104


def write_volume(path, texels: np.ndarray) -> None:
    """Writes ``texels`` (depth, height, width, 4) float16 or float32, linear RGB and alpha."""
    depth, height, width, _ = texels.shape
    channel = texels.dtype.itemsize
    descriptor = _descriptor(channel)
    entry = b"KTXwriter\0" + f"Gridlight {program_version()}".encode() + b"\0"
    pairs = struct.pack("<I", len(entry)) + entry
    pairs += b"\0" * (-len(pairs) % 4)
    pairs_offset = _DESCRIPTOR_OFFSET + len(descriptor)
    data = np.ascontiguousarray(texels, f"<f{channel}").tobytes()
    before = pairs_offset + len(pairs)
    padding = -before % (4 * channel)
    header = struct.pack("<9I", _FORMATS[channel], channel, width, height, depth, 0, 1, 1, 0)
    index = struct.pack("<4I2Q", _DESCRIPTOR_OFFSET, len(descriptor), pairs_offset, len(pairs), 0, 0)
    level = struct.pack("<3Q", before + padding, len(data), len(data))
    with open(path, "wb") as file:
        for part in (IDENTIFIER, header, index, level, descriptor, pairs, b"\0" * padding, data):
            file.write(part)


def _descriptor(channel: int) -> bytes:
    """The basic data format descriptor of four float channels of ``channel`` bytes."""
    samples = b""
    for number, kind in enumerate((0, 1, 2, _ALPHA)):
        bits = 8 * channel
        samples += struct.pack("<HBB4xff", number * bits, bits - 1, kind | _SIGNED_FLOAT, -1.0, 1.0)
    size = 24 + len(samples)
    block = struct.pack("<IHH4B4B8B", 0, 2, size, _RGBSDA, _BT709, _LINEAR, 0, 0, 0, 0, 0, 4 * channel, *[0] * 7)
    return struct.pack("<I", 4 + size) + block + samples
