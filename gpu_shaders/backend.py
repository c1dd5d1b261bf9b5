# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake's work on the GPU, one method per kind of dispatch. The job in ``bake/`` decides what runs when.

Texel surfaces of a batch of probes are layered images, one layer a probe, FACE wide and 6·FACE high. They stay on the
GPU while the memory budget allows; the field never leaves it between iterations.
"""

from __future__ import annotations

from dataclasses import dataclass

import gpu
import numpy as np

from ..core import lookup
from ..core.conventions import CULLED, DEPTH_EDGE
from ..core.cubemap import texel_solid_angles
from ..core.dilation import nearest_active
from ..core.emitters import sampling_density
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.world_map import world_texels
from .programs import program
from .raster_capture import RasterCapture
from .scene_textures import SceneTextures
from .textures import allocate, layers, read, upload

_GROUP = 64  # threads that share a probe where its texels are summed
_EMITTER_SAMPLES = 1024  # points on emitters that each probe looks at besides its texels
# Kept images of texel surfaces. Albedo is 32 bit: in a bright room an error of 1e-4 in 0.99 is one of 1e-2 in the
# light.
_SURFACE_FORMATS = {
    "geometry": "RGBA32F",
    "albedo": "RGBA32F",
    "emission": "RGBA32F",
    "source": "RGBA32F",
    "weights0": "RGBA16F",
    "weights1": "RGBA16F",
}
BYTES_PER_TEXEL = sum(16 if pixel == "RGBA32F" else 8 for pixel in _SURFACE_FORMATS.values())
_HIT_BYTES = 20  # hit record and depth, which exist during capture only


@dataclass
class _Hits:
    """Layered image of hits, layer = probe·6 + face of the capture in hand."""

    texture: gpu.types.GPUTexture
    layers: int


@dataclass
class Surfaces:
    """Texel surfaces of the probes in slots ``first`` .. ``first + count``."""

    first: int
    count: int
    textures: dict


class GpuBackend:
    """Bakes one scene with one set of settings; the grid's active probes are given by ``set_probes``."""

    def __init__(self, snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings):
        self.grid = grid
        self.settings = settings
        self.face = settings.face
        self.coefficients = settings.bands**2
        self.scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
        self.object_count = max(len(snapshot.object_names), 1)
        self._shells = upload(np.zeros((self.object_count, 4)), "objects")
        weights = np.zeros((self.face * self.face, 4), np.float32)
        weights[:, 0] = texel_solid_angles(self.face).ravel()
        self._texel_weights = upload(weights, "texels")
        background = np.zeros((6 * self.face**2, 4), np.float32)
        background[:, :3] = world_texels(snapshot.world, self.face).reshape(-1, 3)
        self._world_texels = upload(background, "texels")
        self._change = gpu.types.GPUTexture((1, 1), format="RGBA32F")
        layer_limit = gpu.capabilities.max_texture_layers_get()
        texels = 6 * self.face**2
        budget = settings.memory_mib << 20
        self._probes_per_capture = max(1, min(layer_limit // 6, budget // 4 // (texels * _HIT_BYTES)))
        self.probes_per_batch = max(1, min(layer_limit, budget // (texels * BYTES_PER_TEXEL)))
        self.probes_in_budget = max(1, budget // (texels * BYTES_PER_TEXEL))
        self._hits = None
        self._raster = None

    # Probes
    # -----------------------------------------------------------------------------------------------------------------

    def set_probes(self, nodes: np.ndarray, positions: np.ndarray) -> None:
        """Active probes: ``nodes`` (S,) grid indices and ``positions`` (S, 3) world metres, by slot."""
        self._nodes = nodes
        self._positions = np.asarray(positions, float) - self.grid.center
        slots = np.zeros((len(nodes), 4), np.float32)
        slots[:, :3] = self._positions
        slots[:, 3] = nodes
        self._probe_slots = upload(slots, "probes")

    def allocate_field(self) -> None:
        """The field of the last three iterations, newest first, and the statistics of the active probes, all zero."""
        elements = self.grid.count * self.coefficients
        self._field = [allocate(elements, "field coefficients") for _ in range(3)]
        self._moments = allocate(len(self._nodes) * DEPTH_EDGE**2, "depth statistics", "RG32F")
        self._shares = allocate(len(self._nodes), "probes")

    def set_states(self, state: np.ndarray) -> None:
        """Makes probe states (P,) known to lookups; call after statistics, before lookup weights."""
        nodes = np.full((self.grid.count, 4), -2.0, np.float32)
        nodes[state == CULLED, 3] = -1.0
        nodes[:, :3] = self.grid.positions() - self.grid.center
        nodes[self._nodes, :3] = self._positions
        slot_is_active = state[self._nodes] == 1
        nodes[self._nodes[slot_is_active], 3] = np.flatnonzero(slot_is_active)
        self._grid_nodes = upload(nodes, "grid nodes")
        active = np.zeros(self.grid.count, bool)
        active[self._nodes[slot_is_active]] = True
        inactive = np.flatnonzero(~active)
        pairs = np.zeros((len(inactive), 4), np.float32)
        if active.any():
            pairs[:, 0], pairs[:, 1] = inactive, nearest_active(self.grid, active)[inactive]
        self._inactive = upload(pairs, "inactive nodes") if len(inactive) and active.any() else None
        self._inactive_count = len(inactive)
        info = lookup.grid_info(self.grid)
        self._grid_info = gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", info.size, info.reshape(-1)))

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
            hits = self._hit_images(part)
            if method == "raster":
                if self._raster is None:
                    self._raster = RasterCapture(self.scene, self.face, hits.layers // 6)
                self._raster(
                    self._positions[first_slot : first_slot + part], first_slot, self._probe_slots, hits.texture
                )
            else:
                self._trace(first_slot, part, hits)
            self._resolve(first_slot, first_layer, part, hits, surfaces)

    def _hit_images(self, count: int):
        if self._hits is None or self._hits.layers < count * 6:
            self._raster = None  # its depth image has as many layers
            self._hits = _Hits(layers(self.face, self.face, count * 6, "RGBA32F"), count * 6)
        return self._hits

    def _trace(self, first_slot: int, count: int, hits) -> None:
        shader = program("capture_trace_comp", FACE=self.face, **self.scene.ray_defines)
        self.scene.bind_rays(shader)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        shader.image("hits", hits.texture)
        shader.uniform_int("first_slot", (first_slot,))
        self._dispatch_texels(shader, count)

    def _resolve(self, first_slot: int, first_layer: int, count: int, hits, surfaces: Surfaces) -> None:
        shader = program("surface_resolve_comp", FACE=self.face, **self.scene.surface_defines)
        self.scene.bind_surfaces(shader)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        shader.uniform_sampler("world_texels", self._world_texels)
        shader.uniform_sampler("hits", hits.texture)
        for name in ("geometry", "albedo", "emission"):
            shader.image(name, surfaces.textures[name])
        shader.uniform_int("first_slot", (first_slot,))
        shader.uniform_int("first_layer", (first_layer,))
        self._dispatch_texels(shader, count)

    def sightings(self, surfaces: Surfaces) -> np.ndarray:
        """(count, 384): which objects each probe sees, see core/orientation.py. Needs captured surfaces with source."""
        shader = program("object_sightings_comp", FACE=self.face)
        result = allocate(surfaces.count * 96, "sightings")
        for name in ("geometry", "emission", "source"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("sightings", result)
        gpu.compute.dispatch(shader, surfaces.count, 1, 1)
        return read(result, surfaces.count * 96).reshape(surfaces.count, -1)

    def set_shells(self, shells: np.ndarray) -> None:
        """Objects (object_count,) bool whose back faces do not tell the inside of a solid."""
        rows = np.zeros((self.object_count, 4), np.float32)
        rows[: len(shells), 0] = shells
        self._shells = upload(rows, "objects")

    def exits(self, surfaces: Surfaces, layers_: np.ndarray) -> np.ndarray:
        """(L, 6, 4) offset and distance of the nearest surface in each face, for the probes in ``layers_`` (L,)."""
        shader = program("probe_exits_comp", FACE=self.face)
        rows = np.zeros((len(layers_), 4), np.float32)
        rows[:, 0] = layers_
        slots, result = upload(rows, "probes"), allocate(len(layers_) * 6, "exits")
        shader.uniform_sampler("slots", slots)
        shader.uniform_sampler("geometry", surfaces.textures["geometry"])
        shader.image("exits", result)
        gpu.compute.dispatch(shader, len(layers_), 1, 1)
        return read(result, len(layers_) * 6).reshape(-1, 6, 4)

    def statistics(self, surfaces: Surfaces) -> None:
        """Depth moments and what the probes see as a whole. Needs captured surfaces with source and without lookup
        weights."""
        shader = program("probe_statistics_comp", FACE=self.face)
        shader.uniform_sampler("texel_weights", self._texel_weights)
        shader.uniform_sampler("shells", self._shells)
        for name in ("geometry", "emission", "source"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("depth_moments", self._moments)
        shader.image("probe_shares", self._shares)
        shader.uniform_int("first_slot", (surfaces.first,))
        shader.uniform_int("first_layer", (0,))
        shader.uniform_float("depth_clamp", lookup.depth_clamp(self.grid))
        gpu.compute.dispatch(shader, surfaces.count, 1, 1)

    def read_shares(self) -> np.ndarray:
        """(slots, 4) float32 shares of the sphere: back faces of solids, background, lit, all back faces."""
        return read(self._shares, len(self._nodes))

    def read_depth(self) -> np.ndarray:
        """(slots, DEPTH_EDGE², 2) float32 depth moments."""
        moments = read(self._moments, len(self._nodes) * DEPTH_EDGE**2, channels=2)
        return moments.reshape(len(self._nodes), DEPTH_EDGE**2, 2)

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def weigh_lookups(self, surfaces: Surfaces) -> None:
        """Where every texel surface reads the field: weights and first node."""
        shader = program("lookup_weights_comp", FACE=self.face)
        shader.uniform_block("grid_info", self._grid_info)
        shader.uniform_sampler("grid_nodes", self._grid_nodes)
        shader.uniform_sampler("depth_moments", self._moments)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        for name in ("geometry", "weights0", "weights1"):
            shader.image(name, surfaces.textures[name])
        self._set_range(shader, surfaces)
        self._dispatch_texels(shader, surfaces.count)

    def direct_light(self, surfaces: Surfaces, start: int = 0, count: int | None = None) -> None:
        """Fills source: reflected direct light of lamps and sampled emitters, and emission as far as the field carries
        it; of all or of ``count`` probes from ``start``."""
        shader = program("direct_light_comp", FACE=self.face, **self.scene.light_defines)
        self.scene.bind_lights(shader)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        for name in ("geometry", "albedo", "emission"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("source", surfaces.textures["source"])
        count = surfaces.count if count is None else count
        shader.uniform_int("first_slot", (surfaces.first + start,))
        shader.uniform_int("first_layer", (start,))
        shader.uniform_int("samples", (self.settings.samples,))
        shader.uniform_int("seed", (self.settings.seed,))
        self._dispatch_texels(shader, count)

    def iterate(self, surfaces: Surfaces, read_field: bool) -> None:
        """One light iteration of these probes: reads the newest field and writes over the oldest."""
        shader = program(
            "light_iterate_comp",
            FACE=self.face,
            BANDS=self.settings.bands,
            COEFFICIENTS=self.coefficients,
            GROUP=_GROUP,
        )
        shader.uniform_block("grid_info", self._grid_info)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        shader.uniform_sampler("texel_weights", self._texel_weights)
        shader.uniform_sampler("field_in", self._field[0])
        for name in ("geometry", "albedo", "source", "weights0", "weights1"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("field_out", self._field[-1])
        self._set_range(shader, surfaces)
        shader.uniform_int("read_field", (int(read_field),))
        gpu.compute.dispatch(shader, surfaces.count, 1, 1)

    def add_emission(self, surfaces: Surfaces) -> None:
        """Adds what these probes see of sampled emitters to the newest field."""
        shader = program(
            "emission_project_comp",
            FACE=self.face,
            BANDS=self.settings.bands,
            COEFFICIENTS=self.coefficients,
            GROUP=_GROUP,
            **self.scene.light_defines,
        )
        self.scene.bind_surfaces(shader)
        self.scene.bind_emitters(shader)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        shader.uniform_sampler("texel_weights", self._texel_weights)
        for name in ("geometry", "emission"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("field", self._field[0])
        self._set_range(shader, surfaces)
        shader.uniform_int("samples", (_EMITTER_SAMPLES,))
        shader.uniform_int("seed", (self.settings.seed,))
        gpu.compute.dispatch(shader, surfaces.count, 1, 1)

    def gather(self, surfaces: Surfaces) -> None:
        """Adds to source what really traced bounces bring; afterwards iterate without reading the field."""
        shader = program(
            "gather_comp",
            FACE=self.face,
            BANDS=self.settings.bands,
            COEFFICIENTS=self.coefficients,
            **(self.scene.surface_defines | self.scene.light_defines | {"HAS_IMAGES": self.scene.has_images}),
        )
        self.scene.bind_surfaces(shader)
        self.scene.bind_lights(shader)
        shader.uniform_block("grid_info", self._grid_info)
        for name, texture in (
            ("grid_nodes", self._grid_nodes),
            ("depth_moments", self._moments),
            ("field_in", self._field[0]),
            ("world_texels", self._world_texels),
            ("probe_slots", self._probe_slots),
        ):
            shader.uniform_sampler(name, texture)
        for name in ("geometry", "albedo"):
            shader.uniform_sampler(name, surfaces.textures[name])
        shader.image("source", surfaces.textures["source"])
        self._set_range(shader, surfaces)
        for name, value in (
            ("samples", self.settings.samples),
            ("bounces", self.settings.gather),
            ("seed", self.settings.seed),
        ):
            shader.uniform_int(name, (value,))
        self._dispatch_texels(shader, surfaces.count)

    def finish_iteration(self) -> tuple[float, float, float, float]:
        """Fills inactive nodes and makes the field just written the newest.

        Returns sums over active probes: |field|², |change|², change · change before, luminance of band 0.
        """
        self._field.insert(0, self._field.pop())
        if self._inactive is not None:
            shader = program("field_fill_comp", COEFFICIENTS=self.coefficients)
            shader.uniform_sampler("inactive_nodes", self._inactive)
            shader.image("field", self._field[0])
            shader.uniform_int("inactive_count", (self._inactive_count,))
            gpu.compute.dispatch(shader, -(-self._inactive_count * self.coefficients // 64), 1, 1)
        shader = program("field_change_comp", COEFFICIENTS=self.coefficients)
        shader.uniform_sampler("probe_slots", self._probe_slots)
        for name, texture in zip(("field_new", "field_old", "field_older"), self._field):
            shader.uniform_sampler(name, texture)
        shader.image("change", self._change)
        shader.uniform_int("slot_count", (len(self._nodes),))
        gpu.compute.dispatch(shader, 1, 1, 1)
        return tuple(read(self._change, 1)[0].tolist())

    def extrapolate(self, factor: float) -> None:
        """field += factor · (field − field of the iteration before)."""
        shader = program("field_extrapolate_comp", COEFFICIENTS=self.coefficients)
        shader.uniform_sampler("field_old", self._field[1])
        shader.image("field", self._field[0])
        elements = self.grid.count * self.coefficients
        shader.uniform_int("element_count", (elements,))
        shader.uniform_float("factor", factor)
        gpu.compute.dispatch(shader, -(-elements // 64), 1, 1)

    def read_field(self) -> np.ndarray:
        """(P, coefficients, 3) float32 copy of the current field."""
        values = read(self._field[0], self.grid.count * self.coefficients)
        return np.ascontiguousarray(values[:, :3].reshape(self.grid.count, self.coefficients, 3))

    # Dispatch
    # ---------------------------------------------------------------------------------------------------------------

    def _set_range(self, shader, surfaces: Surfaces) -> None:
        shader.uniform_int("first_slot", (surfaces.first,))
        shader.uniform_int("first_layer", (0,))

    def _dispatch_texels(self, shader, probes: int) -> None:
        gpu.compute.dispatch(shader, -(-self.face // 8), -(-6 * self.face // 8), probes)
