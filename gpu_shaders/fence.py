# SPDX-License-Identifier: GPL-3.0-or-later
"""Waiting for the GPU, for measurements: dispatches and draws return before their work is done."""

from __future__ import annotations

import gpu


class Fence:
    """``wait`` returns when everything that was sent to the GPU before is done: a clear and a read-back of one texel
    queue up behind it. Made and used in one GPU context."""

    def __init__(self):
        self._texel = gpu.types.GPUTexture((1, 1), format="RGBA32F")
        self._framebuffer = gpu.types.GPUFrameBuffer(color_slots=(self._texel,))
        with self._framebuffer.bind():  # before that it has no extent to read from
            pass

    def wait(self) -> None:
        self._texel.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        self._framebuffer.read_color(0, 0, 1, 1, 4, 0, "FLOAT")
