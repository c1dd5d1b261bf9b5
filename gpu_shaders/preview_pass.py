# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the scene lit by direct light and a field, traced on the GPU without a window."""

from __future__ import annotations

from collections.abc import Callable

import gpu
import numpy as np

from ..core.camera import Camera
from ..core.display import standard_view, uneven
from ..core.field import Field
from ..core.snapshot import SceneSnapshot
from ..core.sphere_tiles import TILE, tiled_spheres
from ..core.view import View
from .dispatch import dispatch_linear
from .programs import program
from .scene_textures import SceneTextures
from .textures import numbers, read, upload
from .viewport_field import NO_FIELD, FieldTextures
from .viewport_shading import BACKGROUND_FACE, Shading, view_block
from .world_light import world_texture

_MOST_SPHERES = 2048  # per picture, nearest to the camera first
_SPHERE_SHARE = 0.08  # of a cell's shortest edge
_HIDDEN = 0.5  # of the radius, of spheres of probes that hold no light; as preview_comp.glsl has it
_EVEN = 5 / 255  # most difference between neighbours, as shown, that one sample of each may leave


class PreviewPass:
    """Holds scene and field on the GPU; ``render`` takes pictures of them."""

    def __init__(self, snapshot: SceneSnapshot, scene: SceneTextures, field: Field | None, origin: np.ndarray):
        """``scene`` must have been made with ``origin`` (3,). Without a field there is direct light alone."""
        self._scene = scene
        self._origin = origin
        self._field = FieldTextures(field, origin) if field else None
        self._background = world_texture(snapshot.world, BACKGROUND_FACE)

    def render(
        self,
        camera: Camera,
        width: int,
        height: int,
        samples: int,
        shading: Shading | None = None,
        *,
        exposure: float | None = None,
        should_stop=lambda: False,
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """The scene, and the scene with its probes as spheres.

        Args:
            exposure: stops at which the pictures will be shown. Where neighbours then look alike after one sample there
                is no second; None takes all ``samples`` everywhere.

        Each (height, width, 4) float32 linear radiance and coverage, row 0 at the bottom; None when ``should_stop``
        said so.
        """
        shading = shading or Shading()
        if self._field and shading.mode == "ERROR":
            self._field.find_error()
        pictures = [gpu.types.GPUTexture((width, height), format="RGBA32F") for _ in range(2)]
        shader = self._shader()
        bind = self._binding(shader, View.from_camera(camera, 0.01, 1000.0), width, height, shading)
        chosen: np.ndarray | None = None  # all
        listed = numbers(np.zeros(0), "pixels")
        for index in range(samples):
            if should_stop():
                return None
            bind()
            shader.image("picture", pictures[0])
            shader.image("probe_picture", pictures[1])
            shader.image("chosen", listed)
            shader.uniform_int("sample_index", (index,))
            shader.uniform_int("chosen_count", (-1 if chosen is None else len(chosen),))
            dispatch_linear(shader, 64 * -(-width // 8) * -(-height // 8) if chosen is None else len(chosen))
            if index == 0 and exposure is not None:
                shown = [standard_view(values[..., :3], exposure) for values in _read_all(pictures, width, height)]
                chosen = np.flatnonzero(uneven(np.concatenate(shown, axis=2), _EVEN))
                listed = numbers(chosen, "pixels")
        taken = np.full(width * height, samples, np.float32)
        if chosen is not None:
            taken[:] = 1
            taken[chosen] = samples
        sums = _read_all(pictures, width, height)
        for values in sums:
            values[..., :3] /= np.maximum(values[..., 3:], 1.0)
            values[..., 3] /= taken.reshape(height, width)
        return sums[0], sums[1]

    def _shader(self) -> gpu.types.GPUShader:
        return program(
            "preview_comp",
            FACE=BACKGROUND_FACE,
            TILE=TILE,
            **(self._field.defines if self._field else NO_FIELD),
            **self._scene.surface_defines,
            **self._scene.sheet_defines,
        )

    def _binding(
        self, shader: gpu.types.GPUShader, view: View, width: int, height: int, shading: Shading
    ) -> Callable[[], None]:
        """What binds all that is the same for every sample of a picture; what it binds lives as long as it does."""
        field = self._field
        view = view.relative_to(self._origin)
        view_info = view_block(view, height)
        shade_info = shading.block(field.offset if field else np.zeros(3))
        radius = _SPHERE_SHARE * float(field.field.grid.cell_size().min()) if field else 0.0
        spheres = field.spheres(view.camera.position, radius, _MOST_SPHERES) if field else np.zeros((0, 4))
        radii = radius * np.where(spheres[:, 3] < 0, _HIDDEN, 1.0)
        sphere_texture = upload(tiled_spheres(spheres, radii, view.camera, width, height), "spheres")

        def bind() -> None:
            self._scene.bind_surfaces(shader)
            self._scene.bind(shader, "lights")
            self._scene.bind_sheets(shader)
            if field:
                field.bind(shader)
                shader.uniform_sampler("spheres", sphere_texture)
                shader.uniform_float("sphere_radius", radius)
            shader.uniform_sampler("world_texels", self._background)
            shader.uniform_block("view_info", view_info)
            shader.uniform_block("shade_info", shade_info)
            shader.uniform_int("light_count", (self._scene.light_count,))

        return bind


def _read_all(pictures, width: int, height: int) -> list[np.ndarray]:
    """(height, width, 4) float32 of each."""
    return [read(picture, width * height).reshape(height, width, 4) for picture in pictures]
