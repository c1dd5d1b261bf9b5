# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene rasterised in a view and shaded per pixel: what the viewport and the render engine draw.

A picture is the mean of samples that differ in where pixels are looked at and where on the lights shadow rays end. Each
sample is a pass for depth alone and one that shades the nearest surface of every pixel, so no shadow ray is traced for
what is hidden.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.grid import Grid
from ..core.snapshot import World
from ..core.view import View
from .programs import program
from .scene_textures import SceneTextures
from .textures import read, upload
from .viewport_field import NO_FIELD, FieldTextures
from .viewport_shading import BACKGROUND_FACE, Shading, uniform_block, view_block
from .world_light import world_texture

CLUSTER_SIZE = 64  # triangles an instance
MOST_SPHERES = 4096  # drawn of each volume, nearest to the eye first
MOST_VOLUMES = 16  # 64 vec4 of boxes
ENCODINGS = ("SCENE_LINEAR", "OVERLAY", "DISPLAY")
TONE_CURVES = ("STANDARD", "FILMIC", "LINEAR")
FULL_SCREEN = np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)
# Images are rendered in a thread of their own while the viewport draws on, and both set the inputs of one shader.
_one_at_a_time = threading.Lock()
_SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]], np.float32)
# Roberts' R2 sequence, which covers a pixel evenly however many samples are taken; the first is its centre.
_JITTER = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class Probes:
    """How probes are drawn: ``diameter`` as a share of the shortest cell edge."""

    diameter: float = 0.2

    def radius(self, grid: Grid) -> float:
        """Metres; half as much where a probe is culled or invalid."""
        return 0.5 * self.diameter * float(grid.cell_size().min())


class Picture:
    """Sums of samples and depth of one view, made and used in one GPU context (framebuffers belong to contexts)."""

    def __init__(self, width: int, height: int):
        self.width, self.height = width, height
        self.sums = gpu.types.GPUTexture((width, height), format="RGBA32F")
        self.depth = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
        later = gpu.types.GPUTexture((width, height), format="DEPTH_COMPONENT32F")
        # The depth that is shown is that of the first sample, which looks at pixel centres.
        self._framebuffers = [
            (gpu.types.GPUFrameBuffer(color_slots=(self.sums,), depth_slot=depth), depth)
            for depth in (self.depth, later)
        ]
        self.samples = 0

    def wait(self) -> None:
        """Returns when the GPU has drawn everything so far."""
        self._framebuffers[0][0].read_color(0, 0, 1, 1, 4, 0, "FLOAT")

    def begin(self) -> gpu.types.GPUFrameBuffer:
        """The framebuffer of the next sample, with its depth cleared."""
        framebuffer, depth = self._framebuffers[min(self.samples, 1)]
        if self.samples == 0:
            self.sums.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        depth.clear(format="FLOAT", value=(1.0,))
        return framebuffer

    def read(self) -> np.ndarray:
        """(height, width, 4) float32 mean radiance of what is covered, and coverage; row 0 at the bottom."""
        values = read(self.sums, self.width * self.height).reshape(self.height, self.width, 4)
        values[..., :3] /= np.maximum(values[..., 3:], 1.0)
        values[..., 3] = np.minimum(values[..., 3] / max(self.samples, 1), 1.0)
        return values

    def jitter(self) -> tuple[float, float]:
        """Where the next sample looks within pixels, in clip space."""
        offset = (self.samples * _JITTER + 0.5) % 1.0 - 0.5
        return 2 * float(offset[0]) / self.width, 2 * float(offset[1]) / self.height


class ViewportPass:
    """Draws samples of one scene with the fields of its volumes."""

    def __init__(self, scene: SceneTextures, origin: np.ndarray, object_count: int, world: World):
        """``scene`` must have been made with ``origin`` (3,)."""
        self._scene = scene
        self._origin = origin
        self._object_count = max(object_count, 1)
        self._all_visible = upload(np.ones((self._object_count, 4)), "objects")
        self._fields: list[FieldTextures] = []
        self._boxes = None
        self.set_world(world)
        vertices = np.arange(3 * CLUSTER_SIZE, dtype=np.float32)
        self._clusters = _batch(self._surface_program(None), "vertex_number", vertices)

    def set_world(self, world: World) -> None:
        self.world_shines = world.map is not None or any(world.color)
        self._background = world_texture(world, BACKGROUND_FACE)

    def set_fields(self, fields: list[FieldTextures]) -> None:
        """The volumes' fields, MOST_VOLUMES at most; they must share the scene's origin. Where boxes overlap, the
        smallest wins."""
        size = [float(np.prod(np.linalg.norm(item.field.grid.matrix[:3, :3], axis=0))) for item in fields]
        self._fields = [fields[i] for i in np.argsort(size, kind="stable")]
        self._boxes = uniform_block(_boxes(self._fields)) if len(fields) > 1 else None

    def visible(self, flags: np.ndarray | None) -> gpu.types.GPUTexture:
        """Objects (object_count,) bool that a view shows, for ``draw``; None: all."""
        if flags is None or flags.all():
            return self._all_visible
        rows = np.zeros((self._object_count, 4), np.float32)
        rows[: len(flags), 0] = flags
        return upload(rows, "objects")

    def draw(
        self,
        picture: Picture,
        view: View,
        shading: Shading,
        probes: Probes | None,
        visible: gpu.types.GPUTexture | None = None,
        backdrop: bool = True,
    ) -> None:
        """Adds one sample to ``picture``. ``view`` is in world space, ``visible`` comes from the method of that name.

        Where nothing is hit there is the world in views of light, unless ``backdrop`` is False. Sets GPU state without
        restoring it.
        """
        with _one_at_a_time:
            self._draw(picture, view, shading, probes, visible or self._all_visible, backdrop)

    def _draw(self, picture, view, shading, probes, visible, backdrop) -> None:
        if shading.mode == "ERROR":
            for field in self._fields:
                field.find_error()
        local = view.relative_to(self._origin)
        self._sample = _Sample(view_block(local, picture.height, picture.jitter()), shading, picture.samples, visible)
        spheres = [self._spheres(field, local.camera.position, probes) for field in self._fields] if probes else []
        framebuffer = picture.begin()
        with framebuffer.bind():
            gpu.state.viewport_set(0, 0, picture.width, picture.height)
            gpu.state.face_culling_set("NONE")
            gpu.state.depth_test_set("LESS_EQUAL")
            gpu.state.depth_mask_set(True)
            gpu.state.blend_set("NONE")
            gpu.state.color_mask_set(False, False, False, False)
            self._draw_surfaces(0, depth_only=True)
            for field, item in zip(self._fields, spheres):
                self._draw_spheres(field, item, depth_only=True)
            gpu.state.color_mask_set(True, True, True, True)
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("EQUAL")
            gpu.state.blend_set("ADDITIVE_PREMULT")
            for volume in range(max(len(self._fields), 1)):
                self._draw_surfaces(volume, depth_only=False)
            for field, item in zip(self._fields, spheres):
                self._draw_spheres(field, item, depth_only=False)
            if shading.shows_light and backdrop:
                gpu.state.depth_test_set("LESS_EQUAL")
                self._draw_background()
        picture.samples += 1

    def _draw_surfaces(self, volume: int, *, depth_only: bool) -> None:
        field = self._fields[volume] if self._fields else None
        shader = self._surface_program(field)
        shader.bind()
        self._scene.bind_surfaces(shader)
        self._scene.bind(shader, "lights")
        self._scene.bind_sheets(shader)
        shader.uniform_int("light_count", (self._scene.light_count,))
        shader.uniform_int("sample_index", (self._sample.index,))
        shade_info = self._bind_field(shader, field, depth_only)
        shader.uniform_sampler("object_flags", self._sample.visible)
        shader.uniform_int("triangle_count", (self._scene.triangle_count,))
        if self._boxes is not None:
            shader.uniform_block("volume_boxes", self._boxes)
            shader.uniform_int("volume", (volume,))
        self._clusters.draw_instanced(shader, instance_count=-(-self._scene.triangle_count // CLUSTER_SIZE))
        del shade_info

    def _draw_spheres(self, field: FieldTextures, spheres: _Spheres, *, depth_only: bool) -> None:
        if not spheres.count:
            return
        shader = program("viewport_probe", FACE=1, **field.defines)
        shader.bind()
        shade_info = self._bind_field(shader, field, depth_only)
        shader.uniform_sampler("spheres", spheres.texture)
        shader.uniform_float("sphere_radius", spheres.radius)
        _batch(shader, "corner", _SQUARE).draw_instanced(shader, instance_count=spheres.count)
        del shade_info

    def _draw_background(self) -> None:
        shader = program("viewport_background", FACE=BACKGROUND_FACE)
        shader.bind()
        shader.uniform_sampler("world_texels", self._background)
        shader.uniform_block("view_info", self._sample.view_info)
        _batch(shader, "corner", FULL_SCREEN).draw(shader)

    def _bind_field(self, shader, field: FieldTextures | None, depth_only: bool) -> gpu.types.GPUUniformBuf:
        """Returns the block that must live until the draw."""
        if field:
            field.bind(shader)
        shade_info = self._sample.shading.block(field.offset if field else np.zeros(3))
        shader.uniform_block("view_info", self._sample.view_info)
        shader.uniform_block("shade_info", shade_info)
        shader.uniform_int("depth_only", (int(depth_only),))
        return shade_info

    def _surface_program(self, field: FieldTextures | None):
        return program(
            "viewport_surface",
            FACE=1,
            CLUSTER_SIZE=CLUSTER_SIZE,
            VOLUMES=len(self._fields) if len(self._fields) > 1 else None,
            **(field.defines if field else NO_FIELD),
            **self._scene.surface_defines,
            **self._scene.sheet_defines,
        )

    def _spheres(self, field: FieldTextures, eye: np.ndarray, probes: Probes) -> _Spheres:
        radius = probes.radius(field.field.grid)
        rows = field.spheres(eye, radius, MOST_SPHERES)
        return _Spheres(upload(rows, "spheres"), len(rows), radius)


@dataclass(frozen=True)
class _Sample:
    """What all draws of one sample share."""

    view_info: gpu.types.GPUUniformBuf
    shading: Shading
    index: int
    visible: gpu.types.GPUTexture


@dataclass(frozen=True)
class _Spheres:
    texture: gpu.types.GPUTexture
    count: int
    radius: float  # metres


def display(
    picture: Picture,
    encoding: str,
    *,
    exposure: float = 0.0,
    tone_curve: str = "STANDARD",
    gamma: float = 1.0,
    depth_scale_offset: tuple[float, float] = (1.0, 0.0),
) -> None:
    """Draws ``picture`` over the whole of the framebuffer in use, with its depth; see viewport_display_frag.

    ``exposure`` in stops. Depth passes through ``depth_scale_offset`` where there is a surface.
    """
    shader = program("viewport_display")
    shader.bind()
    shader.uniform_sampler("picture", picture.sums)
    shader.uniform_sampler("picture_depth", picture.depth)
    shader.uniform_int("sample_count", (max(picture.samples, 1),))
    shader.uniform_int("encoding", (ENCODINGS.index(encoding),))
    shader.uniform_int("tone_curve", (TONE_CURVES.index(tone_curve),))
    shader.uniform_float("exposure", exposure)
    shader.uniform_float("gamma", gamma)
    shader.uniform_float("depth_scale_offset", depth_scale_offset)
    _batch(shader, "corner", FULL_SCREEN).draw(shader)


def _batch(shader, attribute: str, values: np.ndarray):
    return batch_for_shader(shader, "TRIS", {attribute: values})


def _boxes(fields: list[FieldTextures]) -> np.ndarray:
    """(4·V, 4) float32 volume_boxes of viewport_surface_frag."""
    rows = np.zeros((len(fields), 4, 4), np.float32)
    for row, field in zip(rows, fields):
        matrix = field.field.grid.matrix.copy()
        matrix[:3, 3] = field.offset
        row[:3] = np.linalg.inv(matrix)[:3]
        row[3, :3] = np.linalg.norm(matrix[:3, :3], axis=0)
    return rows.reshape(-1, 4)
