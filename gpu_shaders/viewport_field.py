# SPDX-License-Identifier: GPL-3.0-or-later
"""A finished field as textures, for pictures and the viewport."""

from __future__ import annotations

import gpu
import numpy as np

from ..core import lookup
from ..core.conventions import ACTIVE, CULLED
from ..core.depth_map import sights
from ..core.error_estimate import interpolation_error
from ..core.field import Field
from ..core.gradients import per_cell
from .textures import upload


class FieldTextures:
    """What shaders read of one field. Its frame is the grid's centre; ``offset`` leads there from the scene's
    origin."""

    def __init__(self, field: Field, origin: np.ndarray):
        """``origin`` (3,): what the scene's textures are relative to, world metres."""
        grid = field.grid
        self.field = field
        self.offset = grid.center - origin
        self.bands = field.bands
        rows = np.zeros((*field.coefficients.shape[:2], 4), np.float32)
        rows[..., :3] = field.coefficients
        gradient = per_cell(grid, field.gradient)
        steps = np.zeros((*gradient.shape[:3], 4), np.float32)
        steps[..., :3] = gradient
        self.positions = grid.positions() + field.offset - grid.center
        active = np.flatnonzero(field.state == ACTIVE)
        nodes = np.full((grid.count, 4), -2.0, np.float32)
        nodes[:, :3] = self.positions
        nodes[field.state == CULLED, 3] = -1.0
        nodes[active, 3] = np.arange(len(active))
        self._marks = np.zeros((grid.count, 4), np.float32)
        self._marks[:, 0], self._marks[:, 1] = field.validity, field.state
        self._error_is_known = False
        self._textures = {
            "field_in": upload(rows, "field coefficients"),
            "gradient_in": upload(steps, "field gradients"),
            "grid_nodes": upload(nodes, "grid nodes"),
            "sights": upload(sights(field.depth[active], lookup.depth_clamp(grid)), "depth statistics"),
            "node_marks": upload(self._marks, "grid nodes"),
        }
        self._grid_info = gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", 20, lookup.grid_info(grid).reshape(-1)))

    @property
    def defines(self) -> dict:
        """What shaders that read a field are compiled with; without one, ``NO_FIELD``."""
        return {"HAS_FIELD": True, "BANDS": self.bands, "COEFFICIENTS": self.bands**2}

    def find_error(self) -> None:
        """Makes the heat map's errors known, which cost too much to find for fields that change in every frame."""
        if not self._error_is_known:
            self._marks[:, 2] = interpolation_error(self.field)
            self._textures["node_marks"] = upload(self._marks, "grid nodes")
            self._error_is_known = True

    @property
    def light_textures(self) -> tuple[gpu.types.GPUTexture, gpu.types.GPUTexture]:
        """Coefficients and gradients, to be written to."""
        return self._textures["field_in"], self._textures["gradient_in"]

    def take_light_of(self, other: FieldTextures) -> None:
        """Takes coefficients and gradients from ``other``, which is given up, if it has as many for as many nodes."""
        if other.bands == self.bands and other.field.grid.resolution == self.field.grid.resolution:
            for name in ("field_in", "gradient_in"):
                self._textures[name] = other._textures[name]

    def bind(self, shader) -> None:
        for name, texture in self._textures.items():
            shader.uniform_sampler(name, texture)
        shader.uniform_block("grid_info", self._grid_info)

    def spheres(self, eye: np.ndarray, radius: float, most: int) -> np.ndarray:
        """(S, 4) float32: centres of the ``most`` probes nearest to ``eye`` (3,) in the scene's frame; node index, or
        −1 where culled, −2 where invalid. Probes right before the eye are left out: they would hide the picture."""
        field = self.field
        marks = np.where(field.state == ACTIVE, np.arange(len(field.state)), np.where(field.state == CULLED, -1, -2))
        centres = np.concatenate([self.positions + self.offset, marks[:, None]], axis=1)
        distance = np.linalg.norm(centres[:, :3] - eye, axis=1)
        distance[distance < 6 * radius] = np.inf
        nearest = np.argsort(distance, kind="stable")[: min(most, int(np.isfinite(distance).sum()))]
        return centres[nearest].astype(np.float32)


NO_FIELD = {"HAS_FIELD": False, "BANDS": 1, "COEFFICIENTS": 1}
