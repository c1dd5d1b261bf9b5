# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake, readable and slow: capture → patches → direct light → bounces → field, in float64 with every ray tested
against every triangle.

Readable twin of the shaders capture_trace_comp, surface_resolve_comp, object_sightings_comp, probe_statistics_comp,
field_project_comp, field_gradient_comp, and by reference_light.py and reference_emitters.py of all that light patches
and emitters; for scenes of some hundred triangles and a few probes. What the GPU stores in fewer bits is rounded here
as well, because no reference could come near otherwise: images, points of patches and their normals.

Texels of a probe count face by face, row by row: X = 6·face². P probes, N patches.
"""

from __future__ import annotations

import numpy as np

from . import culling, dilation, gradients, lookup
from . import spherical_harmonics as sh
from .conventions import ACTIVE, CULLED, INVALID
from .cubemap import (
    direction_to_texel,
    octahedral_encode,
    pack_normal,
    texel_directions,
    texel_solid_angles,
)
from .depth_map import LEAST_COSINE, map_directions, sample_directions
from .direct_light import sample_light
from .field import Field
from .gloss import TEXEL_RAYS
from .grid import Grid
from .open_air import open_nodes
from .orientation import ShellVote, inside_solid
from .patches import NO_PATCH, gather_rays
from .reference_gloss import TexelReflections, texel_reflections
from .reference_light import ReferenceLight
from .reference_scene import ReferenceScene, Surfaces
from .sampling import keys_of, sample_r2
from .settings import BakeSettings
from .sheets import off_surface
from .snapshot import DIFFUSE_RAYS, SceneSnapshot
from .world_map import world_texels
from .world_suns import PROBE_RAYS, extract_suns

_SUN_STREAM = 0x7F4A7C15


class ReferenceBake:
    """One bake of ``snapshot`` into ``grid``, stage by stage, so that tests can compare each with the GPU's.

    ``nodes`` (S,) are the grid nodes that capture, active ones and those in the open. ``offset`` (grid.count, 3) metres
    are moves of probes out of walls, which the reference takes as given (core/relocation.py).
    """

    def __init__(self, snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, offset: np.ndarray | None = None):
        self.snapshot, self.grid, self.settings = snapshot, grid, settings
        self.scene = ReferenceScene(snapshot, grid.center)
        self.light = ReferenceLight(self.scene, grid, settings)
        self.directions = texel_directions(settings.face).reshape(-1, 3)
        self.solid_angles = np.tile(texel_solid_angles(settings.face).ravel(), 6)
        needed = settings.keep_all or culling.needed_nodes(grid, snapshot.triangle_positions)
        self.state = np.where(np.broadcast_to(needed, grid.count), ACTIVE, CULLED).astype(np.uint8)
        in_the_open = open_nodes(grid, self.state, np.zeros(grid.count, bool))
        self.nodes = np.sort(np.concatenate([np.flatnonzero(self.state == ACTIVE), in_the_open]))
        self.offset = np.zeros((grid.count, 3)) if offset is None else np.asarray(offset, float)
        self.positions = (grid.positions() + self.offset)[self.nodes] - grid.center

    # Capture
    # ----------------------------------------------------------------------------------------------------------------

    def capture(self) -> Surfaces:
        """What the texels (P, X) of all probes see; of background, its radiance is in ``emission``."""
        shape = (len(self.nodes), len(self.directions))
        origins = np.repeat(self.positions, shape[1], axis=0)
        directions = np.tile(self.directions, (shape[0], 1))
        hits = self.scene.closest(origins, directions)
        flat = self.scene.resolve(hits, directions, 2.0 / self.settings.face)
        missed = hits.triangle < 0
        background = world_texels(extract_suns(self.snapshot.world)[0], self.settings.face).reshape(-1, 3)
        flat.emission[missed] = np.tile(background, (shape[0], 1))[missed]
        tint = self.scene.tint(origins, directions, np.where(missed, np.inf, hits.distance), DIFFUSE_RAYS)
        flat.albedo *= tint
        flat.emission *= tint
        return Surfaces(*(value.reshape(*shape, *value.shape[1:]) for value in vars(flat).values()))

    def points(self, surfaces: Surfaces) -> np.ndarray:
        """(P, X, 3) hit points relative to the grid's centre; the probe's own position for background."""
        distance = np.where(surfaces.triangle >= 0, surfaces.distance, 0.0)
        return self.positions[:, None] + self.directions * distance[..., None]

    def texel_hits(self, surfaces: Surfaces) -> np.ndarray:
        """(P, X, 4) position and packed normal where texels meet what reflects, −1 elsewhere."""
        hits = np.zeros((*surfaces.triangle.shape, 4), np.float32)
        reflects = (surfaces.triangle >= 0) & surfaces.albedo.any(axis=2)
        hits[..., 3] = -1.0
        directions = np.broadcast_to(self.directions, self.points(surfaces).shape)[reflects]
        both_sides = self.scene.sheet_shares[self.texel_sheets(surfaces)[reflects]].any(axis=1)
        hits[reflects, :3] = off_surface(
            self.points(surfaces)[reflects], directions, surfaces.distance[reflects], both_sides
        )
        hits[reflects, 3] = pack_normal(octahedral_encode(surfaces.normal[reflects]))
        return hits

    def texel_sheets(self, surfaces: Surfaces) -> np.ndarray:
        """(P, X) sheets that the texels see, 0 for none."""
        return np.where(surfaces.triangle >= 0, self.scene.sheet[surfaces.triangle], 0)

    def reflections(self, surfaces: Surfaces) -> TexelReflections:
        """What glossy texels mirror and send back diffusely; ``surfaces`` as captured."""
        where = self.positions, self.nodes, self.settings.face, self.settings.seed
        return texel_reflections(self.light.gloss, surfaces, *where)

    def mirrored(self, reflections: TexelReflections, ends: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
        """(P, X, 3) radiance that texels mirror by the ``irradiance`` (N, 3) of the patches ``ends`` (P·X·K,) on which
        their rays end."""
        if not len(irradiance):
            return reflections.carried
        each = (*reflections.carried.shape[:2], TEXEL_RAYS)
        coming = np.where((ends >= 0)[:, None], reflections.sent * irradiance[np.maximum(ends, 0)] / np.pi, 0.0)
        counted = np.maximum((ends != NO_PATCH).reshape(each).sum(axis=2), 1)
        return reflections.carried + coming.reshape(*each, 3).sum(axis=2) / counted[..., None]

    def bind(self, surfaces: Surfaces) -> np.ndarray:
        """(P, X) patches that the texels lie on, founded where there are none; −1 where nothing is to be lit."""
        hits = self.texel_hits(surfaces)
        distance = np.linalg.norm(hits[..., :3] - self.positions[:, None], axis=2)
        sheets = self.texel_sheets(surfaces).ravel()
        return self.light.bind_texels(hits.reshape(-1, 4), distance.ravel(), sheets).reshape(surfaces.triangle.shape)

    def reflected(self, surfaces: Surfaces, patch: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
        """(P, X, 3) radiance that texels reflect by the ``irradiance`` (N, 3) of their ``patch`` (P, X)."""
        if not len(irradiance):
            return np.zeros(surfaces.albedo.shape)
        return np.where((patch >= 0)[..., None], surfaces.albedo * irradiance[patch] / np.pi, 0.0)

    # Statistics
    # -------------------------------------------------------------------------------------------------------------

    def shells(self, surfaces: Surfaces, reflected: np.ndarray) -> np.ndarray:
        """(objects,) bool: whose back faces are not the inside of a solid, by 8×8 texels of each face, see
        core/orientation.py."""
        face = self.settings.face
        at = (2 * np.arange(8) + 1) * face // 16
        index = ((np.arange(6)[:, None, None] * face + at[:, None]) * face + at).ravel()
        triangle = surfaces.triangle[:, index]
        lit = surfaces.emission[:, index].any(axis=2) | reflected[:, index].any(axis=2)
        seen = self.snapshot.object_index[triangle] + 1 + 0.5 * lit
        vote = ShellVote(max(len(self.snapshot.object_names), 1))
        vote.add(np.where(triangle < 0, 0.0, np.where(surfaces.back[:, index], -seen, seen)))
        return vote.shells()

    def shares(self, surfaces: Surfaces, reflected: np.ndarray) -> np.ndarray:
        """(P, 4) shares of the sphere: back faces of solids, background, anything that sends light, all back faces."""
        background = surfaces.triangle < 0
        back = surfaces.back & ~background
        solid = back & ~self.shells(surfaces, reflected)[self.snapshot.object_index[surfaces.triangle]]
        lit = surfaces.emission.any(axis=2) | reflected.any(axis=2)
        return np.stack([seen @ self.solid_angles for seen in (solid, background, lit, back)], axis=1) / (4 * np.pi)

    def depth_statistics(self, surfaces: Surfaces) -> np.ndarray:
        """(P, DEPTH_EDGE², DEPTH_VALUES), see Field.depth, of 16 directions a texel."""
        distance = surfaces.distance[:, self._texels_along(sample_directions())]
        distance = np.minimum(distance, lookup.depth_clamp(self.grid))
        at = self._texels_along(map_directions())
        surface = surfaces.triangle[:, at] >= 0
        normal = np.where(surface[..., None], surfaces.normal[:, at], -map_directions())
        slant = (normal * self.directions[at]).sum(axis=-1)
        slant /= np.minimum((normal * map_directions()).sum(axis=-1), -LEAST_COSINE)
        middle = np.where(
            surface, surfaces.distance[:, at] * np.where(slant > 0, slant, 1.0), lookup.depth_clamp(self.grid)
        )
        packed = pack_normal(octahedral_encode(normal))
        return np.stack([distance.mean(axis=-1), (distance**2).mean(axis=-1), packed, middle], axis=-1)

    def _texels_along(self, directions: np.ndarray) -> np.ndarray:
        """(…) indices of the texels that ``directions`` (…, 3) pass."""
        face, row, column = direction_to_texel(directions, self.settings.face)
        return (face * self.settings.face + row) * self.settings.face + column

    def field_statistics(self, surfaces: Surfaces, reflected: np.ndarray) -> Field:
        """A dark field with states, validity and depth."""
        shares = self.shares(surfaces, reflected)
        field = Field.empty(self.grid, self.settings.bands)
        field.state[:] = self.state
        field.validity[self.nodes] = 1 - shares[:, 0]
        field.depth[self.nodes] = self.depth_statistics(surfaces)
        field.offset[:] = self.offset
        inside = self.nodes[inside_solid(shares)]
        buried = inside[self.state[inside] == CULLED]
        field.depth[buried], field.validity[buried] = 0.0, 1.0
        field.state[inside[self.state[inside] == ACTIVE]] = INVALID
        return field

    # Field
    # ------------------------------------------------------------------------------------------------------------------

    def project(self, surfaces: Surfaces, reflected: np.ndarray) -> np.ndarray:
        """(P, K, 3) coefficients of what texels send: ``reflected`` (P, X, 3), emission that is not sampled, and the
        background."""
        sampled = (surfaces.triangle >= 0) & (self.light.emitters.density[surfaces.triangle] > 0)
        radiance = reflected + np.where(sampled[..., None], 0.0, surfaces.emission)
        return sh.project(radiance, self.directions, self.solid_angles, self.settings.bands)

    def highlights(self, surfaces: Surfaces, patch: np.ndarray) -> np.ndarray:
        """(P, X, 3) radiance that texels send in highlights by the direct light of their ``patch`` (P, X)."""
        if not self.light.highlights.is_there:
            return np.zeros(surfaces.albedo.shape)
        where = self.positions, self.nodes, patch, self.light.direct_by_part
        return self.light.highlights.of_texels(surfaces, *where, self.settings.face, self.settings.seed)

    def project_emitters(self, surfaces: Surfaces) -> np.ndarray:
        """(P, K, 3) coefficients of what probes see of sampled emitters."""
        by_texels = sh.project(
            self._emitted_by_texels(surfaces), self.directions, self.solid_angles, self.settings.bands
        )
        points = [self._seen_points(slot) for slot in range(len(self.nodes))] if self.light.emitters.count else []
        for coefficients, seen in zip(by_texels, points):
            coefficients += sh.project(seen.flux, seen.direction, np.ones(len(seen.flux)), self.settings.bands)
        return by_texels

    def project_suns(self) -> np.ndarray:
        """(P, K, 3) coefficients of what probes see of the suns of the world: rays to their discs."""
        result = np.zeros((len(self.nodes), self.settings.bands**2, 3))
        count, index = len(self.nodes), np.arange(PROBE_RAYS)
        origins = np.repeat(self.positions, PROBE_RAYS, axis=0)
        for number, sun in enumerate(extract_suns(self.snapshot.world)[1]):
            keys = np.repeat(keys_of(self.nodes, _SUN_STREAM + number, self.settings.seed), PROBE_RAYS, axis=0)
            sample = sample_light(sun, origins, sample_r2(keys, np.tile(index, count)).astype(float))
            seen = self.scene.visible(origins, sample.directions, sample.distances)
            tint = self.scene.tint(origins, sample.directions, sample.distances)
            flux = (sample.irradiance * tint * seen[:, None] / PROBE_RAYS).reshape(count, PROBE_RAYS, 3)
            basis = sh.basis(sample.directions, self.settings.bands).reshape(count, PROBE_RAYS, -1)
            result += np.einsum("prk,prc->pkc", basis, flux)
        return result

    def gradient(self, surfaces: Surfaces, reflected: np.ndarray) -> np.ndarray:
        """(P, 3, K, 3) change of all coefficients per metre, not limited."""
        sampled = (surfaces.triangle >= 0) & (self.light.emitters.density[surfaces.triangle] > 0)
        emitted = np.where(sampled[..., None], self._emitted_by_texels(surfaces), surfaces.emission)
        nearest, bands = gradients.least_distance(self.grid), gradients.gradient_bands(self.settings.bands)
        edges = gradients.texel_edges(self.settings.face)
        radiance = reflected + emitted
        inside = surfaces.back & ~radiance.any(axis=2)
        result = gradients.edge_gradient(edges, radiance, surfaces.distance, inside, nearest, bands)
        for slot in range(len(self.nodes) if self.light.emitters.count else 0):
            seen = self._seen_points(slot)
            result[slot] += gradients.point_gradient(
                seen.direction, seen.distance, seen.normal, seen.flux, nearest, bands
            )
        return result

    def _emitted_by_texels(self, surfaces: Surfaces) -> np.ndarray:
        """(P, X, 3) radiance of sampled emitters in the texels that answer for them."""
        radiance = np.zeros(surfaces.emission.shape)
        for slot in range(len(self.nodes) if self.light.emitters.count else 0):
            seen = Surfaces(*(value[slot] for value in vars(surfaces).values()))
            radiance[slot] = self.light.emitters.texel_radiance(seen, self.directions, self.settings.face)
        return radiance

    def _seen_points(self, slot: int):
        return self.light.emitters.seen_points(int(self.nodes[slot]), self.positions[slot], self.settings)


def bake(snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, offset: np.ndarray | None = None) -> Field:
    """The field after ``settings.bounces`` bounces, which must be given: the reference does not judge convergence."""
    assert settings.bounces is not None
    job = ReferenceBake(snapshot, grid, settings, offset)
    surfaces = job.capture()
    reflections = job.reflections(surfaces)
    surfaces.albedo = reflections.diffuse
    ends = job.light.bind_reflections(reflections)
    patch = job.bind(surfaces)
    job.light.light_new_patches()
    mirrored = job.mirrored(reflections, ends, job.light.direct)
    field = job.field_statistics(surfaces, job.reflected(surfaces, patch, job.light.direct) + mirrored)
    job.light.connect()
    irradiance = job.light.iterate(settings.bounces)
    highlighted = job.highlights(surfaces, patch)
    mirrored = job.mirrored(reflections, ends, irradiance)
    if settings.gather:
        hits = job.texel_hits(surfaces).reshape(-1, 4)
        sheets = job.texel_sheets(surfaces).ravel()
        irradiance = job.light.gather(hits, gather_rays(settings.samples), irradiance, 0, sheets)
        patch = np.where(patch >= 0, np.arange(patch.size).reshape(patch.shape), patch)
    reflected = job.reflected(surfaces, patch, irradiance) + mirrored
    coefficients = job.project(surfaces, reflected + highlighted) + job.project_emitters(surfaces) + job.project_suns()
    field.coefficients = np.zeros((grid.count, settings.bands**2, 3))
    field.coefficients[job.nodes] = coefficients
    field.coefficients = dilation.fill(grid, field.coefficients, field.holds_light)
    field.gradient = field.gradient.astype(float)
    field.gradient[job.nodes] = job.gradient(surfaces, reflected)
    field.gradient[~field.holds_light] = 0.0
    field.gradient = gradients.limited(grid, field.gradient, field.coefficients, field.state == ACTIVE)
    return field
