# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake, readable and slow: capture → texel surfaces → direct light → iterations → field, in float64 with every ray
tested against every triangle.

Readable twin of the shaders capture_trace_comp, surface_resolve_comp with surface_lib, object_sightings_comp,
probe_statistics_comp, lookup_weights_comp, direct_light_comp and light_iterate_comp; for scenes of some hundred
triangles and a few probes. Two things are rounded as the GPU stores them, because no reference could come near
otherwise: images and lookup weights are half floats.

Texels of a probe count face by face, row by row: X = 6·face². P probes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import culling, dilation, lookup, rays
from . import spherical_harmonics as sh
from .conventions import ACTIVE, CULLED, DEPTH_EDGE, INVALID
from .cubemap import direction_to_texel, octahedral_decode, texel_directions, texel_place_directions, texel_solid_angles
from .direct_light import irradiance as light_irradiance
from .field import Field
from .grid import Grid
from .images import sample_image
from .orientation import ShellVote, inside_solid
from .sampling import PLACE_STREAM, light_stream, sample_r2, texel_keys
from .settings import BakeSettings
from .snapshot import NO_IMAGE, SceneSnapshot
from .world_map import world_texels


@dataclass
class TexelSurfaces:
    """What the texels of P probes see; see surface_resolve_comp.glsl. ``distance`` is infinite where a texel sees
    background, whose radiance is then in ``emission``."""

    distance: np.ndarray  # (P, X) metres
    triangle: np.ndarray  # (P, X) int, −1 background
    back: np.ndarray  # (P, X) bool: seen from behind
    normal: np.ndarray  # (P, X, 3) shading normal on the viewer's side
    albedo: np.ndarray  # (P, X, 3)
    emission: np.ndarray  # (P, X, 3) radiance


class ReferenceBake:
    """One bake of ``snapshot`` into ``grid``, stage by stage, so that tests can compare each with the GPU's.

    ``nodes`` (S,) are the grid nodes that capture; ``capture`` comes first, then ``source``, ``field_statistics`` and
    ``iterate``. ``offset`` (grid.count, 3) metres are moves of probes out of walls, which the reference takes as given
    (core/relocation.py).
    """

    def __init__(self, snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, offset: np.ndarray | None = None):
        self.snapshot, self.grid, self.settings = snapshot, grid, settings
        self.triangles = snapshot.triangle_positions - grid.center
        self.directions = texel_directions(settings.face).reshape(-1, 3)
        self.solid_angles = np.tile(texel_solid_angles(settings.face).ravel(), 6)
        needed = settings.keep_all or culling.needed_nodes(grid, snapshot.triangle_positions)
        self.state = np.where(np.broadcast_to(needed, grid.count), ACTIVE, CULLED).astype(np.uint8)
        self.nodes = np.flatnonzero(self.state == ACTIVE)
        self.offset = np.zeros((grid.count, 3)) if offset is None else np.asarray(offset, float)
        self.positions = (grid.positions() + self.offset)[self.nodes] - grid.center
        clips = np.array([material.alpha_threshold > 0 for material in snapshot.materials])
        self._clipped = clips[snapshot.material_index]

    # Capture
    # ----------------------------------------------------------------------------------------------------------------

    def capture(self) -> TexelSurfaces:
        """Texel surfaces of all probes."""
        shape = (len(self.nodes), len(self.directions))
        origins = np.repeat(self.positions, shape[1], axis=0)
        directions = np.tile(self.directions, (shape[0], 1))
        hits = rays.closest_hit(self.triangles, origins, directions, self._hole_test())
        background = world_texels(self.snapshot.world, self.settings.face).reshape(-1, 3)
        flat = self._resolve(hits, origins, directions)
        missed = hits.triangle < 0
        flat.emission[missed] = np.tile(background, (shape[0], 1))[missed]
        return TexelSurfaces(*(value.reshape(*shape, *value.shape[1:]) for value in vars(flat).values()))

    def _hole_test(self):
        return self.is_hole if self._clipped.any() else None

    def is_hole(self, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(K,) bool: is the material of ``triangle`` (K,) clipped away at ``barycentric`` (K, 2)? Images at full
        resolution."""
        hole = np.zeros(len(triangle), bool)
        for index, material in enumerate(self.snapshot.materials):
            here = np.flatnonzero((self.snapshot.material_index[triangle] == index) & self._clipped[triangle])
            alpha = np.full(len(here), float(material.alpha))
            if material.alpha_image != NO_IMAGE and len(here):
                uv = _interpolate(self.snapshot.corner_uvs[triangle[here]], barycentric[here])
                texel = sample_image(self.snapshot.images[material.alpha_image], uv, np.zeros(len(here)))
                alpha *= texel[:, :3].mean(axis=1) if material.alpha_from_color else texel[:, 3]
            hole[here] = alpha < material.alpha_threshold
        return hole

    def _resolve(self, hits: rays.Hits, origins: np.ndarray, directions: np.ndarray) -> TexelSurfaces:
        """Surfaces of rays (N,); fields of rays that hit nothing are zero."""
        count = len(origins)
        surfaces = TexelSurfaces(
            hits.distance, hits.triangle, np.zeros(count, bool), *(np.zeros((count, 3)) for _ in range(3))
        )
        hit = np.flatnonzero(hits.triangle >= 0)
        triangle, barycentric, direction = hits.triangle[hit], hits.barycentric[hit], directions[hit]
        corners = self.triangles[triangle]
        edge = corners[:, 1:] - corners[:, :1]
        geometric = np.cross(edge[:, 0], edge[:, 1])
        facing = np.einsum("ni,ni->n", geometric, direction)
        surfaces.back[hit] = facing > 0
        normal = _interpolate(self.snapshot.corner_normals[triangle], barycentric)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        surfaces.normal[hit] = np.where(facing[:, None] > 0, -normal, normal)

        # Width of what a texel covers on the surface, in uv: distance × angle, stretched by the slant, × uv units per
        # metre.
        area = np.linalg.norm(geometric, axis=1)
        uv = _interpolate(self.snapshot.corner_uvs[triangle], barycentric)
        slant = np.maximum(np.abs(facing) / area, 0.1)
        footprint = hits.distance[hit] * (2.0 / self.settings.face) / np.sqrt(slant) * self._uv_per_metre()[triangle]
        for index, material in enumerate(self.snapshot.materials):
            here = np.flatnonzero(self.snapshot.material_index[triangle] == index)
            albedo = np.tile(np.array(material.base_color, float) * material.diffuse_share, (len(here), 1))
            emission = np.tile(np.array(material.emission, float), (len(here), 1))
            if material.base_image != NO_IMAGE:
                albedo *= sample_image(self.snapshot.images[material.base_image], uv[here], footprint[here])[:, :3]
            if material.emission_image != NO_IMAGE:
                emission *= sample_image(self.snapshot.images[material.emission_image], uv[here], footprint[here])[
                    :, :3
                ]
            surfaces.albedo[hit[here]], surfaces.emission[hit[here]] = albedo, emission
        return surfaces

    def _uv_per_metre(self) -> np.ndarray:
        """(T,) square root of a triangle's area in uv over its area in the world."""
        edge = self.triangles[:, 1:] - self.triangles[:, :1]
        uv_edge = self.snapshot.corner_uvs[:, 1:].astype(float) - self.snapshot.corner_uvs[:, :1]
        uv_area = np.abs(np.linalg.det(uv_edge))
        return np.sqrt(uv_area / np.maximum(np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1), 1e-30))

    # Statistics
    # -------------------------------------------------------------------------------------------------------------

    def shells(self, surfaces: TexelSurfaces, source: np.ndarray) -> np.ndarray:
        """(objects,) bool: whose back faces are not the inside of a solid, by 8×8 texels of each face, see
        core/orientation.py."""
        face = self.settings.face
        at = (2 * np.arange(8) + 1) * face // 16
        index = ((np.arange(6)[:, None, None] * face + at[:, None]) * face + at).ravel()
        triangle = surfaces.triangle[:, index]
        lit = surfaces.emission[:, index].any(axis=2) | source[:, index].any(axis=2)
        seen = self.snapshot.object_index[triangle] + 1 + 0.5 * lit
        vote = ShellVote(max(len(self.snapshot.object_names), 1))
        vote.add(np.where(triangle < 0, 0.0, np.where(surfaces.back[:, index], -seen, seen)))
        return vote.shells()

    def shares(self, surfaces: TexelSurfaces, source: np.ndarray) -> np.ndarray:
        """(P, 4) shares of the sphere: back faces of solids, background, anything that sends light, all back faces."""
        background = surfaces.triangle < 0
        back = surfaces.back & ~background
        solid = back & ~self.shells(surfaces, source)[self.snapshot.object_index[surfaces.triangle]]
        lit = surfaces.emission.any(axis=2) | source.any(axis=2)
        return np.stack([seen @ self.solid_angles for seen in (solid, background, lit, back)], axis=1) / (4 * np.pi)

    def depth_moments(self, surfaces: TexelSurfaces) -> np.ndarray:
        """(P, DEPTH_EDGE², 2) mean and mean square of clamped distance, 16 directions over one and a half texels
        each."""
        step = (np.arange(4) - 1.5) * 0.375
        column, row = np.meshgrid(np.arange(DEPTH_EDGE), np.arange(DEPTH_EDGE))
        place = np.stack(
            np.broadcast_arrays(column[..., None, None] + 0.5 + step, row[..., None, None] + 0.5 + step[:, None]), -1
        )
        uv = place.reshape(DEPTH_EDGE**2, 16, 2) * (2.0 / DEPTH_EDGE) - 1.0
        for axis in (0, 1):  # past the edge of the map the sphere goes on where the edge is mirrored to
            past = np.abs(uv[..., axis]) > 1
            uv[..., 1 - axis] = np.where(past, -uv[..., 1 - axis], uv[..., 1 - axis])
            uv[..., axis] = np.where(past, np.sign(uv[..., axis]) * 2 - uv[..., axis], uv[..., axis])
        face, row, column = direction_to_texel(octahedral_decode(uv), self.settings.face)
        texel = (face * self.settings.face + row) * self.settings.face + column
        distance = np.minimum(surfaces.distance[:, texel], lookup.depth_clamp(self.grid))
        return np.stack([distance.mean(axis=-1), (distance**2).mean(axis=-1)], axis=-1)

    def field_statistics(self, surfaces: TexelSurfaces, source: np.ndarray) -> Field:
        """A dark field with states, validity and depth."""
        shares = self.shares(surfaces, source)
        field = Field.empty(self.grid, self.settings.bands)
        field.state[:] = self.state
        field.state[self.nodes[inside_solid(shares)]] = INVALID
        field.validity[self.nodes] = 1 - shares[:, 0]
        field.depth[self.nodes] = self.depth_moments(surfaces)
        field.offset[:] = self.offset
        return field

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def points(self, surfaces: TexelSurfaces) -> np.ndarray:
        """(P, X, 3) hit points relative to the grid's centre; the probe's own position for background."""
        distance = np.where(surfaces.triangle >= 0, surfaces.distance, 0.0)
        return self.positions[:, None] + self.directions * distance[..., None]

    def source(self, surfaces: TexelSurfaces) -> np.ndarray:
        """(P, X, 3) emission plus reflected direct light of all lights, each sample at another place of the texel's
        footprint."""
        probe, texel = np.nonzero((surfaces.triangle >= 0) & surfaces.albedo.any(axis=2))
        normals = surfaces.normal[probe, texel]
        incoming = np.zeros((len(probe), 3))
        for index in range(self.settings.samples):
            directions, distances = self._look_at_place(surfaces, probe, texel, index)
            points = self.positions[probe] + directions * distances[:, None]
            origins = rays.step_off(points, normals, -directions, distances)
            for number, light in enumerate(self.snapshot.lights):
                u = sample_r2(texel_keys(self.nodes[probe], texel, light_stream(number), self.settings.seed), index)
                incoming += light_irradiance(
                    light, points + self.grid.center, origins, normals, u.astype(float), self._visible
                )
        source = surfaces.emission.copy()
        source[probe, texel] += surfaces.albedo[probe, texel] / np.pi * incoming / self.settings.samples
        return source

    def _look_at_place(self, surfaces: TexelSurfaces, probe: np.ndarray, texel: np.ndarray, index: int):
        """Directions (N, 3) and distances (N,) of sample ``index`` on the planes of the texels' surfaces; the centre
        where a single sample is taken, the surface is not flat or the plane is seen edge-on."""
        centre, distance = self.directions[texel], surfaces.distance[probe, texel]
        if self.settings.samples == 1:
            return centre, distance
        is_flat = self._lies_flat(surfaces)[probe, texel]
        place = sample_r2(texel_keys(self.nodes[probe], texel, PLACE_STREAM, self.settings.seed), index).astype(float)
        moved = texel_place_directions(texel, place, self.settings.face)
        normals = surfaces.normal[probe, texel]
        with np.errstate(divide="ignore"):
            moved_distance = distance * np.einsum("ni,ni->n", centre, normals) / np.einsum("ni,ni->n", moved, normals)
        usable = is_flat & (moved_distance > 0.5 * distance) & (moved_distance < 2 * distance)
        return np.where(usable[:, None], moved, centre), np.where(usable, moved_distance, distance)

    def _lies_flat(self, surfaces: TexelSurfaces) -> np.ndarray:
        """(P, X) bool: do a texel's neighbours on its face lie on its plane?"""
        face = self.settings.face
        grid = (len(surfaces.triangle), 6, face, face)
        seen = (surfaces.triangle >= 0).reshape(grid)
        distance = np.where(surfaces.triangle >= 0, surfaces.distance, 0.0)
        point = (self.directions * distance[..., None]).reshape(*grid, 3)
        normal, distance = surfaces.normal.reshape(*grid, 3), distance.reshape(grid)
        is_flat = seen.copy()
        for axis in (2, 3):
            for step in (1, -1):
                here = [slice(None)] * 4
                there = [slice(None)] * 4
                here[axis], there[axis] = (slice(None, -1), slice(1, None))[::step]
                here, there = tuple(here), tuple(there)
                apart = np.abs(np.einsum("...i,...i->...", point[there] - point[here], normal[here]))
                alike = np.einsum("...i,...i->...", normal[there], normal[here]) >= 0.99
                is_flat[here] &= seen[there] & alike & (apart <= 0.01 * distance[here])
        return is_flat.reshape(surfaces.triangle.shape)

    def _visible(self, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray) -> np.ndarray:
        return ~rays.any_hit(self.triangles, origins, directions, limits, self._hole_test())

    def lookups(self, surfaces: TexelSurfaces, field: Field) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (P, X, 8) and weights (P, X, 8) with which each texel's surface reads the field."""
        points = self.points(surfaces).reshape(-1, 3) + self.grid.center
        nodes, weights = lookup.lookup_weights(field, points, surfaces.normal.reshape(-1, 3))
        stored = weights.astype(np.float16).astype(float)
        shape = (*surfaces.triangle.shape, 8)
        return nodes.reshape(shape), (stored / stored.sum(axis=1, keepdims=True)).reshape(shape)

    def iterate(self, surfaces: TexelSurfaces, source: np.ndarray, field: Field, lookups) -> np.ndarray:
        """(grid.count, K, 3) next coefficients: outgoing radiance of every texel, projected to SH; other nodes filled.

        Outgoing radiance is source + albedo/π · max(0, irradiance of ``field``); ``lookups`` as returned by
        ``lookups``.
        """
        nodes, weights = lookups
        outgoing = source.copy()
        for slot in range(len(self.nodes)):  # one probe at a time bounds the memory
            blended = np.einsum("xw,xwkc->xkc", weights[slot], field.coefficients[nodes[slot]].astype(float))
            incoming = np.maximum(sh.irradiance(blended, surfaces.normal[slot]), 0)
            outgoing[slot] += surfaces.albedo[slot] / np.pi * incoming
        coefficients = np.zeros((self.grid.count, self.settings.bands**2, 3))
        coefficients[self.nodes] = sh.project(outgoing, self.directions, self.solid_angles, self.settings.bands)
        active = field.state == ACTIVE
        return coefficients[dilation.nearest_active(self.grid, active)]


def bake(snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, offset: np.ndarray | None = None) -> Field:
    """The field after ``settings.bounces`` bounces, which must be given: the reference does not judge convergence."""
    job = ReferenceBake(snapshot, grid, settings, offset)
    surfaces = job.capture()
    source = job.source(surfaces)
    field = job.field_statistics(surfaces, source)
    lookups = job.lookups(surfaces, field)
    field.coefficients = np.zeros((grid.count, settings.bands**2, 3))
    for _ in range(settings.bounces + 1):
        field.coefficients = job.iterate(surfaces, source, field, lookups)
    field.coefficients = dilation.fill(grid, field.coefficients, field.state == ACTIVE)
    return field


def _interpolate(values: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """(N, C) blend of corner ``values`` (N, 3, C) by the weights of corners 1 and 2, (N, 2)."""
    first = 1 - barycentric.sum(axis=1, keepdims=True)
    return values[:, 0] * first + values[:, 1] * barycentric[:, :1] + values[:, 2] * barycentric[:, 1:]
