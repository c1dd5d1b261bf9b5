# SPDX-License-Identifier: GPL-3.0-or-later
"""What pictures show and from where, as the blocks that viewport_shade_lib.glsl and viewport_surface_vert.glsl read."""

from __future__ import annotations

from dataclasses import dataclass

import gpu
import numpy as np

from ..core.view import View

MODES = ("FULL", "DIRECT", "INDIRECT", "IRRADIANCE", "NORMALS", "VALIDITY", "ERROR")
PROBE_SHADINGS = ("IRRADIANCE", "RADIANCE")
BACKGROUND_FACE = 128  # texels: resolution of the world behind the scene
_PHONG_EXPONENT = 40.0


@dataclass(frozen=True)
class Shading:
    """``mode``: one of MODES. ``indirect``: factor on the field's light. ``highlight``: share of direct light that the
    Phong lobe reflects; 0.04 is what glass, paint and plastics reflect head-on. ``probes``: one of PROBE_SHADINGS.
    """

    mode: str = "FULL"
    indirect: float = 1.0
    highlight: float = 0.04
    probes: str = "IRRADIANCE"

    @property
    def shows_light(self) -> bool:
        """Whether the world behind the scene belongs to the picture."""
        return MODES.index(self.mode) <= MODES.index("INDIRECT")

    @property
    def shows_amounts(self) -> bool:
        """Whether what is shown is light, to be exposed, and not data as colours."""
        return MODES.index(self.mode) <= MODES.index("IRRADIANCE")

    def block(self, field_offset: np.ndarray) -> gpu.types.GPUUniformBuf:
        """``shade_info`` for a field whose centre is at ``field_offset`` (3,) in the scene's frame."""
        rows = np.zeros((2, 4), np.float32)
        rows[0] = (*field_offset, MODES.index(self.mode))
        rows[1] = self.indirect, self.highlight, _PHONG_EXPONENT, PROBE_SHADINGS.index(self.probes)
        return uniform_block(rows)


def view_block(view: View, height: int, jitter: tuple[float, float] = (0.0, 0.0)) -> gpu.types.GPUUniformBuf:
    """``view_info`` of ``view`` in the scene's frame, for an image ``height`` pixels high; ``jitter`` moves the picture
    in clip space."""
    camera = view.camera
    rows = np.zeros((9, 4))
    rows[0] = (*camera.position, camera.orthographic)
    rows[1, :3], rows[2, :3] = camera.right, camera.up
    rows[3] = (*camera.forward, view.angular_width(height))
    rows[4:8] = view.to_clip
    rows[4:6] += np.outer(jitter, view.to_clip[3])
    rows[8, :2] = jitter
    return uniform_block(rows.astype(np.float32))


def uniform_block(rows: np.ndarray) -> gpu.types.GPUUniformBuf:
    """Uniform buffer of ``rows`` (N, 4) float32."""
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", rows.size, np.ascontiguousarray(rows).reshape(-1)))
