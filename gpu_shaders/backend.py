# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake's work on the GPU, one method per kind of dispatch. The job in ``bake/`` decides what runs when.

Texel surfaces of a batch of probes are layered images, one layer a probe, FACE wide and 6·FACE high. They stay on the
GPU while the memory budget allows; the field never leaves it between iterations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import gpu
import numpy as np

from ..core import lookup
from ..core.blocks import Block
from ..core.conventions import DEPTH_EDGE
from ..core.cubemap import texel_solid_angles
from ..core.depth_map import DEPTH_VALUES
from ..core.emitters import sampling_density
from ..core.grid import Grid
from ..core.patches import gather_rays
from ..core.scene_changes import SceneChanges
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import Pace, Steps
from .emission_pass import project_emitters
from .gloss_pass import GlossPass
from .gradient_pass import GradientPass
from .highlight_pass import add_highlights
from .patch_light import PatchLight
from .places import Places
from .programs import program
from .raster_capture import RasterCapture
from .scene_textures import SceneTextures
from .sun_pass import add_suns
from .textures import allocate, layers, numbers, read, scratch, upload
from .world_light import send_world

_GROUP = 64  # threads that share a probe where its texels are summed
# Kept images of texel surfaces. Albedo is 32 bit: in a bright room an error of 1e-4 in 0.99 is one of 1e-2 in light.
_SURFACE_FORMATS = {"geometry": "RGBA32F", "albedo": "RGBA32F", "emission": "RGBA32F"}
BYTES_PER_TEXEL = 16 * len(_SURFACE_FORMATS)
_GATHER_RAYS = 1 << 20  # at once
_TEXELS_AT_ONCE = 1 << 19  # that are bound to patches; their surfaces take 24 MiB
_HIT_BYTES = 20  # hit record and depth, which exist during capture only


@dataclass
class _Hits:
    """Layered image of hits, layer = probe·6 + face of the capture in hand."""

    texture: gpu.types.GPUTexture
    layers: int


def probes_in_budget(settings: BakeSettings, bytes_per_texel: int = BYTES_PER_TEXEL) -> int:
    """Probes whose texel surfaces fit the memory budget together."""
    return max(1, (settings.memory_mib << 20) // (6 * settings.face**2 * bytes_per_texel))


@dataclass
class Surfaces:
    """Texel surfaces of the probes in slots ``first`` .. ``first + count``."""

    first: int
    count: int
    textures: dict


class GpuBackend:
    """Bakes one scene with one set of settings; the grid's active probes are given by ``set_probes``."""

    def __init__(
        self,
        snapshot: SceneSnapshot,
        grid: Grid,
        settings: BakeSettings,
        scene: SceneTextures | None = None,
        pace: Pace | None = None,
        block: Block | None = None,
    ):
        """``scene``: ``snapshot`` with the grid's centre as origin, made here where it is not given. ``pace``: of what
        is done in steps. ``block``: the part of ``grid`` that the probes are of; patches and random numbers are its
        own."""
        self._block = block
        self._pace = pace or Pace(None)
        self.grid = grid
        self.settings = settings
        self.face = settings.face
        self.coefficients = settings.bands**2
        self.scene = scene or SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
        self.object_count = max(len(snapshot.object_names), 1)
        self._shells = upload(np.zeros((self.object_count, 4)), "objects")
        weights = np.zeros((self.face * self.face, 4), np.float32)
        weights[:, 0] = texel_solid_angles(self.face).ravel()
        self._texel_weights = upload(weights, "texels")
        self.gloss = GlossPass(self.scene, self.face)
        self._gradient = GradientPass(settings.face, settings.bands, grid)
        self.world_texels = send_world(self.scene, snapshot.world, self.face)
        self.forget_patches()
        layer_limit = gpu.capabilities.max_texture_layers_get()
        texels = 6 * self.face**2
        budget = settings.memory_mib << 20
        self._probes_per_capture = max(1, min(layer_limit // 6, budget // 4 // (texels * _HIT_BYTES)))
        # Patches are found portion by portion, the same in every batch size: the memory budget changes no byte.
        self._portion = min(layer_limit, max(1, _TEXELS_AT_ONCE // texels))
        bytes_per_texel = BYTES_PER_TEXEL + self.gloss.bytes_per_texel
        fitting = max(1, min(layer_limit, budget // (texels * bytes_per_texel)))
        self.probes_per_batch = max(fitting // self._portion, 1) * self._portion
        self.probes_in_budget = probes_in_budget(settings, bytes_per_texel)
        self._hits: _Hits | None = None
        self._raster: RasterCapture | None = None

    @classmethod
    def make(
        cls,
        snapshot: SceneSnapshot,
        grid: Grid,
        settings: BakeSettings,
        pace: Pace,
        scene: SceneTextures | None = None,
        block: Block | None = None,
    ) -> Steps[GpuBackend]:
        """The same in steps."""
        if scene is not None:
            return cls(snapshot, grid, settings, scene, pace, block)
        density = yield from pace.in_background(sampling_density, snapshot, grid)
        scene = yield from SceneTextures.make(snapshot, grid.center, density, pace)
        return cls(snapshot, grid, settings, scene, pace, block)

    def update(self, snapshot: SceneSnapshot, changes: SceneChanges) -> str:
        """Brings the scene to ``snapshot``; texel surfaces and patches stay what they are. Returns what became of the
        hierarchy, see SceneTextures.update."""
        surfaces = changes.emission or changes.reflectance or changes.materials or changes.images
        density = sampling_density(snapshot, self.grid) if changes.shape or surfaces else None
        hierarchy = self.scene.update(snapshot, changes, density)
        if changes.shape:
            self._raster = None  # it knows where triangles lie
            self.object_count = max(len(snapshot.object_names), 1)
        if changes.world:
            self.world_texels = self.light.world_texels = send_world(self.scene, snapshot.world, self.face)
        return hierarchy

    # Probes
    # -----------------------------------------------------------------------------------------------------------------

    def set_probes(self, nodes: np.ndarray, positions: np.ndarray) -> None:
        """Active probes: ``nodes`` (S,) grid indices and ``positions`` (S, 3) world metres, by slot."""
        self._nodes = nodes
        self._positions = np.asarray(positions, float) - self.grid.center
        slots = np.zeros((len(nodes), 4), np.float32)
        slots[:, :3] = self._positions
        slots[:, 3] = nodes
        self.probe_slots = upload(slots, "probes")

    def allocate_field(self) -> None:
        """Field and statistics of the active probes, all zero."""
        self._field = allocate(len(self._nodes) * self.coefficients, "field coefficients")
        self._gradient.allocate(len(self._nodes))
        self.forget_emission()
        self._depth = allocate(len(self._nodes) * DEPTH_EDGE**2, "depth statistics")
        self._shares = allocate(len(self._nodes), "probes")

    # Capture
    # ----------------------------------------------------------------------------------------------------------------

    def surfaces(self, first: int, count: int) -> Surfaces:
        """Empty texel surfaces for slots ``first`` .. ``first + count``."""
        textures = {name: layers(self.face, 6 * self.face, count, pixel) for name, pixel in _SURFACE_FORMATS.items()}
        return Surfaces(first, count, textures)

    def capture(self, surfaces: Surfaces, method: str, start: int = 0, count: int | None = None) -> None:
        """Fills geometry, albedo and emission of all or of ``count`` probes from ``start``. ``method``: "raster" or
        "trace"."""
        stop = surfaces.count if count is None else start + count
        for first_layer in range(start, stop, self._probes_per_capture):
            part = min(self._probes_per_capture, stop - first_layer)
            first_slot = surfaces.first + first_layer
            hits = self.find_hits(first_slot, part, method)
            self._resolve(first_slot, first_layer, part, hits, surfaces)

    def find_hits(self, first_slot: int, count: int, method: str) -> _Hits:
        """What the texels of ``count`` probes from ``first_slot`` see; holds until the next call."""
        hits = self._hit_images(count)
        if method == "raster":
            if self._raster is None:
                self._raster = RasterCapture(self.scene, self.face, hits.layers // 6)
            self._raster(self._positions[first_slot : first_slot + count], first_slot, self.probe_slots, hits.texture)
        else:
            self._trace(first_slot, count, hits)
        return hits

    def _hit_images(self, count: int):
        if self._hits is None or self._hits.layers < count * 6:
            self._raster = None  # its depth image has as many layers
            self._hits = _Hits(layers(self.face, self.face, count * 6, "RGBA32F"), count * 6)
        return self._hits

    def _trace(self, first_slot: int, count: int, hits) -> None:
        shader = program("capture_trace_comp", FACE=self.face, **self.scene.ray_defines)
        self.scene.bind_rays(shader)
        shader.uniform_sampler("probe_slots", self.probe_slots)
        shader.image("hits", hits.texture)
        shader.uniform_int("first_slot", (first_slot,))
        self._dispatch_texels(shader, count)

    def _resolve(self, first_slot: int, first_layer: int, count: int, hits, surfaces: Surfaces) -> None:
        shader = program("surface_resolve_comp", FACE=self.face, **self.scene.surface_defines)
        self.scene.bind_surfaces(shader)
        shader.uniform_sampler("probe_slots", self.probe_slots)
        shader.uniform_sampler("world_texels", self.world_texels)
        shader.uniform_sampler("hits", hits.texture)
        for name in ("geometry", "albedo", "emission"):
            shader.image(name, surfaces.textures[name])
        shader.uniform_int("first_slot", (first_slot,))
        shader.uniform_int("first_layer", (first_layer,))
        self._dispatch_texels(shader, count)

    def set_shells(self, shells: np.ndarray) -> None:
        """Objects (object_count,) bool whose back faces do not tell the inside of a solid."""
        rows = np.zeros((self.object_count, 4), np.float32)
        rows[: len(shells), 0] = shells
        self._shells = upload(rows, "objects")

    def statistics(self, surfaces: Surfaces, start: int = 0, count: int | None = None) -> None:
        """Depth moments and what all or ``count`` probes from ``start`` see as a whole. Needs direct light."""
        shader = program("probe_statistics_comp", FACE=self.face, **self.gloss.defines)
        self.gloss.bind(shader, surfaces.textures, self.light.direct)
        shader.uniform_sampler("texel_weights", self._texel_weights)
        shader.uniform_sampler("shells", self._shells)
        shader.uniform_sampler("patch_irradiance", self.light.direct)
        self.scene.bind(shader, "triangle_attributes")
        for name in ("geometry", "albedo", "emission"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("depth_statistics", self._depth)
        shader.image("probe_shares", self._shares)
        shader.uniform_int("first_slot", (surfaces.first + start,))
        shader.uniform_int("first_layer", (start,))
        shader.uniform_float("depth_clamp", lookup.depth_clamp(self.grid))
        gpu.compute.dispatch(shader, surfaces.count if count is None else count, 1, 1)

    def read_shares(self) -> np.ndarray:
        """(slots, 4) float32 shares of the sphere: back faces of solids, background, lit, all back faces."""
        return read(self._shares, len(self._nodes))

    def read_depth(self) -> np.ndarray:
        """(slots, DEPTH_EDGE², DEPTH_VALUES) float32 depth statistics, see Field."""
        statistics = read(self._depth, len(self._nodes) * DEPTH_EDGE**2, DEPTH_VALUES)
        return statistics.reshape(len(self._nodes), DEPTH_EDGE**2, DEPTH_VALUES)

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def forget_patches(self) -> None:
        """Begins with no patch: all texels must be bound again."""
        grid, settings = self.grid, self.settings
        if self._block is not None:
            grid, settings = self._block.grid(grid), replace(settings, seed=self._block.seed(settings.seed))
        self.light = PatchLight(self.scene, grid, settings, self.world_texels, self._pace)

    def release_scratch(self) -> None:
        """Lets go of what only a capture needs."""
        self._hits = self._raster = None
        self.light.release_scratch()

    def bind(self, surfaces: Surfaces, start: int = 0, count: int | None = None) -> Steps[None]:
        """Finds the patches on which the texels of all or of ``count`` probes from ``start`` lie, in steps."""
        first = surfaces.first + start
        stop = surfaces.first + surfaces.count if count is None else first + count
        while first < stop:
            end = min(stop, (first // self._portion + 1) * self._portion)
            yield from self.reflect(surfaces, first - surfaces.first, end - first)
            self._bind_portion(surfaces, first - surfaces.first, end - first)
            first = end
            yield

    def _bind_portion(self, surfaces: Surfaces, start: int, count: int) -> None:
        first = surfaces.first + start
        texels = self._texel_hits(surfaces, start, count)
        patches = self.light.patches.bind_texels(texels, self.face, self.probe_slots, first, count)
        shader = program("texel_patches_comp", FACE=self.face)
        shader.uniform_sampler("patches", patches)
        shader.image("albedo", surfaces.textures["albedo"])
        shader.uniform_int("first_layer", (start,))
        self._dispatch_texels(shader, count)

    def reflect(self, surfaces: Surfaces, start: int, count: int) -> Steps[None]:
        """Finds what glossy texels of ``count`` probes from ``start`` mirror, in steps."""
        where = (start, count, surfaces.count), self.probe_slots, surfaces.first + start, self.world_texels
        yield from self.gloss.reflect(surfaces.textures, *where, self.light.patches, self.settings.seed, self._pace)

    def _texel_hits(self, surfaces: Surfaces, start: int, count: int) -> Places:
        """Where texels meet surface, as one linear array."""
        shader = program("texel_hits_comp", FACE=self.face, **self.scene.sheet_defines)
        texels = count * 6 * self.face**2
        hits = Places(
            scratch(texels, "texels"), 1, scratch(texels, "texels", "R32F") if self.scene.has_sheets else None
        )
        self.scene.bind_sheets(shader)
        if hits.sheets is not None:
            shader.image("hit_sheets", hits.sheets)
        shader.uniform_sampler("probe_slots", self.probe_slots)
        self.scene.bind(shader, "triangle_corners")
        for name in ("geometry", "albedo"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("hits", hits.points)
        shader.uniform_int("first_slot", (surfaces.first + start,))
        shader.uniform_int("first_layer", (start,))
        self._dispatch_texels(shader, count)
        return hits

    def project(self, surfaces: Surfaces, layers_: np.ndarray) -> None:
        """The field of the probes in ``layers_`` (L,): what their texels send by the light of their patches."""
        self._project(surfaces, layers_, self.light.irradiance, own_texels=False)

    def gather(self, surfaces: Surfaces, layers_: np.ndarray) -> None:
        """The field of the probes in ``layers_`` (L,) by a final gather: every texel with light and paths of its
        own."""
        texels = 6 * self.face**2
        at_once = max(1, _GATHER_RAYS // (texels * gather_rays(self.settings.samples)))
        for run in np.split(layers_, np.flatnonzero(np.diff(layers_) != 1) + 1):
            for start in range(0, len(run), at_once):
                some = run[start : start + at_once]
                hits = self._texel_hits(surfaces, int(some[0]), len(some))
                first_key = (surfaces.first + int(some[0])) * texels
                irradiance = self.light.gather(hits, len(some) * texels, first_key)
                self._project(surfaces, some, irradiance, own_texels=True)

    def _project(self, surfaces: Surfaces, layers_: np.ndarray, irradiance, own_texels: bool) -> None:
        shader = program(
            "field_project_comp",
            FACE=self.face,
            BANDS=self.settings.bands,
            COEFFICIENTS=self.coefficients,
            GROUP=_GROUP,
            **self.gloss.defines,
        )
        listed = numbers(layers_, "probes")
        self.gloss.bind(shader, surfaces.textures, self.light.irradiance)
        shader.uniform_sampler("probe_layers", listed)
        shader.uniform_sampler("texel_weights", self._texel_weights)
        shader.uniform_sampler("patch_irradiance", irradiance)
        shader.uniform_sampler("emitted", self._emitted)
        for name in ("albedo", "emission"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("field", self._field)
        shader.uniform_int("first_slot", (surfaces.first,))
        shader.uniform_int("own_texels", (int(own_texels),))
        gpu.compute.dispatch(shader, len(layers_), 1, 1)
        layers_and_count = (listed, len(layers_))
        add_suns(self.scene, self.settings, self.probe_slots, surfaces.first, layers_and_count, self._field)
        if self.scene.has_faint_gloss:
            seen_from = self.probe_slots, surfaces.first, surfaces.textures, layers_and_count
            parts = self.light.direct_by_part()
            add_highlights(self.scene, self.settings, seen_from, self._texel_weights, parts, self._field, _GROUP)
        where = surfaces.textures, surfaces.first, layers_and_count
        how = self._texel_weights, irradiance, own_texels, _GROUP, self.gloss, self.light.irradiance
        self._gradient.project(*where, *how)

    def forget_emission(self) -> None:
        """No probe sees a sampled emitter."""
        self._gradient.forget_emission()
        self._emitted = allocate(len(self._nodes) * self.coefficients, "field coefficients")

    def find_emission(self, surfaces: Surfaces, layers_: np.ndarray) -> None:
        """What the probes in ``layers_`` (L,) see of sampled emitters; ``project`` and ``gather`` add it."""
        layers_and_count = numbers(layers_, "probes"), len(layers_)
        where = self.probe_slots, surfaces.first, surfaces.textures, layers_and_count
        project_emitters(self.scene, self.settings, where, self._texel_weights, self._gradient, self._emitted)

    @property
    def slot_count(self) -> int:
        return len(self._nodes)

    @property
    def slot_nodes(self) -> np.ndarray:
        """(slots,) grid indices of the probes that capture."""
        return self._nodes

    @property
    def light_textures(self) -> tuple[gpu.types.GPUTexture, gpu.types.GPUTexture]:
        """Field and gradient of all slots, as ``read_field`` and ``read_gradient`` would read them."""
        return self._field, self._gradient.texture

    def read_field(self) -> np.ndarray:
        """(slots, coefficients, 3) float32 copy of the field."""
        values = read(self._field, len(self._nodes) * self.coefficients)
        return np.ascontiguousarray(values[:, :3].reshape(len(self._nodes), self.coefficients, 3))

    def read_gradient(self) -> np.ndarray:
        """(slots, 3, K, 3) float32 copy of the field's gradient per metre, not limited."""
        return self._gradient.read()

    # Dispatch
    # ---------------------------------------------------------------------------------------------------------------

    def _dispatch_texels(self, shader, probes: int) -> None:
        gpu.compute.dispatch(shader, -(-self.face // 8), -(-6 * self.face // 8), probes)
