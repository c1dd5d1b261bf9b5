# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads an image with OpenImageIO, a reader that is not ours: image_reader.py IMAGE RESULT.npz

A process of its own, so that its libraries and Blender's never meet.
"""

import sys

import numpy as np
import OpenImageIO

buffer = OpenImageIO.ImageBuf(sys.argv[1])
if buffer.has_error:
    sys.exit(buffer.geterror())
spec = buffer.spec()
np.savez(
    sys.argv[2],
    names=np.array(spec.channelnames),
    pixels=buffer.get_pixels(OpenImageIO.FLOAT),
    kind=str(spec.format),
    gridlight=spec.getattribute("gridlight") or "",
)
