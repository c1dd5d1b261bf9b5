# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the scene lit by direct light and a field, traced on the GPU without a window."""

from __future__ import annotations

import gpu
import numpy as np

from ..core import lookup
from ..core.camera import Camera
from ..core.conventions import ACTIVE, CULLED, DEPTH_EDGE
from ..core.field import Field
from ..core.snapshot import SceneSnapshot
from ..core.world_map import world_texels
from .programs import program
from .scene_textures import SceneTextures
from .textures import read, upload

_BACKGROUND_FACE = 128  # texels: resolution of the world behind the scene
_MOST_SPHERES = 2048  # per picture, nearest to the camera first


class PreviewPass:
    """Holds scene and field on the GPU; ``render`` takes pictures of them."""

    def __init__(self, snapshot: SceneSnapshot, scene: SceneTextures, field: Field):
        """``scene`` must have been made with the field's grid centre as its origin."""
        self._scene = scene
        self._field = field
        grid = field.grid
        rows = np.zeros((*field.coefficients.shape[:2], 4), np.float32)
        rows[..., :3] = field.coefficients
        self._coefficients = upload(rows, "field coefficients")
        self._positions = grid.positions() + field.offset - grid.center
        active = np.flatnonzero(field.state == ACTIVE)
        nodes = np.full((grid.count, 4), -2.0, np.float32)
        nodes[:, :3] = self._positions
        nodes[field.state == CULLED, 3] = -1.0
        nodes[active, 3] = np.arange(len(active))
        self._nodes = upload(nodes, "grid nodes")
        moments = np.zeros((len(active) * DEPTH_EDGE**2, 4), np.float32)
        moments[:, :2] = field.depth[active].reshape(-1, 2)
        self._moments = upload(moments, "depth statistics")
        self._grid_info = gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", 20, lookup.grid_info(grid).reshape(-1)))
        background = np.zeros((6 * _BACKGROUND_FACE**2, 4), np.float32)
        background[:, :3] = world_texels(snapshot.world, _BACKGROUND_FACE).reshape(-1, 3)
        self._background = upload(background, "texels")

    def render(
        self, camera: Camera, width: int, height: int, samples: int, *, direct: bool = True, should_stop=lambda: False
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """The scene, and the scene with its probes as spheres lit by their own irradiance.

        Each (height, width, 3) float32 linear radiance, row 0 at the bottom; None when ``should_stop`` said so.
        ``direct`` False shows the field's light alone.
        """
        shader = program(
            "preview_comp",
            FACE=_BACKGROUND_FACE,
            BANDS=self._field.bands,
            COEFFICIENTS=self._field.bands**2,
            **self._scene.surface_defines,
        )
        pictures = [gpu.types.GPUTexture((width, height), format="RGBA32F") for _ in range(2)]
        view, centres = self._view(camera)
        view_info = gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", view.size, view.reshape(-1)))
        sphere_texture = upload(centres, "spheres")
        for index in range(samples):
            if should_stop():
                return None
            self._scene.bind_surfaces(shader)
            self._scene.bind(shader, "lights")
            for name, texture in (
                ("grid_nodes", self._nodes),
                ("depth_moments", self._moments),
                ("spheres", sphere_texture),
                ("field_in", self._coefficients),
                ("world_texels", self._background),
            ):
                shader.uniform_sampler(name, texture)
            shader.uniform_block("grid_info", self._grid_info)
            shader.uniform_block("view_info", view_info)
            shader.image("picture", pictures[0])
            shader.image("probe_picture", pictures[1])
            shader.uniform_int("light_count", (self._scene.light_count,))
            shader.uniform_int("sample_index", (index,))
            shader.uniform_int("show_direct", (int(direct),))
            gpu.compute.dispatch(shader, -(-width // 8), -(-height // 8), 1)
        sums = [read(picture, width * height).reshape(height, width, 4) for picture in pictures]
        return tuple(values[..., :3] / values[..., 3:] for values in sums)

    def _view(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        """The view_info block (5, 4) and sphere centres (S, 4)."""
        grid = self._field.grid
        view = np.zeros((5, 4), np.float32)
        eye = camera.position - grid.center
        view[0] = (*eye, camera.orthographic)
        view[1, :3], view[2, :3], view[3, :3] = camera.right, camera.up, camera.forward
        marks = np.where(
            self._field.state == ACTIVE, np.arange(grid.count), np.where(self._field.state == CULLED, -1, -2)
        )
        centres = np.concatenate([self._positions, marks[:, None]], axis=1)
        radius = 0.08 * float(grid.cell_size().min())
        distance = np.linalg.norm(self._positions - eye, axis=1)
        distance[distance < 6 * radius] = np.inf  # one right before the camera would hide the picture
        nearest = np.argsort(distance, kind="stable")[: min(_MOST_SPHERES, int(np.isfinite(distance).sum()))]
        view[4, :2] = radius, len(nearest)
        return view, centres[nearest]
