# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of small emissive surfaces, readable and slow: the twin of emitter_lib.glsl and emission_project_comp.glsl.

Which triangles are sampled and why: core/emitters.py. Positions relative to the volume's centre; N points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cubemap import direction_to_texel, texel_solid_angles
from .emitters import CANDIDATES, PROBE_POINTS, PROBE_RAYS, reach
from .faint_gloss import coupled
from .rays import Hits
from .reference_scene import ReferenceScene, Surfaces
from .sampling import WeightedChoice, keys_of, sample_cosine, sample_r2, sample_r3, shifted
from .settings import BakeSettings
from .snapshot import DIFFUSE_RAYS

_LEAST_COSINE = 1e-4  # between an emitter and the way to a probe
_SHADOW_END = 0.9999  # of the distance to the emitter
_CHOICE_STREAM, _DIRECTION_STREAM, _PROBE_STREAM = 0x68E31DA4, 0x3C6EF372, 0xB5297A4D


@dataclass
class EmitterSamples:
    """Points on emitters, one for each number."""

    point: np.ndarray  # (N, 3)
    normal: np.ndarray  # (N, 3) unit
    radiance: np.ndarray  # (N, 3)
    density: np.ndarray  # (N,) per m²
    group: np.ndarray  # (N,) of light linking


@dataclass
class _Arrival:
    """Light from points on emitters at surfaces, if nothing stands between."""

    irradiance: np.ndarray  # (N, 3)
    point: np.ndarray  # (N, 3) on the emitter
    group: np.ndarray  # (N,)


@dataclass
class SeenPoints:
    """Points on emitters in a probe's sight."""

    direction: np.ndarray  # (N, 3) unit, from the probe
    distance: np.ndarray  # (N,)
    normal: np.ndarray  # (N, 3) unit
    flux: np.ndarray  # (N, 3) radiance times the solid angle that the point stands for


class ReferenceEmitters:
    """Emitters of ``scene`` by ``density`` (T,), see core.emitters.sampling_density."""

    def __init__(self, scene: ReferenceScene, density: np.ndarray):
        self.scene, self.density = scene, density
        self._triangle = np.flatnonzero(density > 0)
        edge = scene.triangles[self._triangle, 1:] - scene.triangles[self._triangle, :1]
        across = np.cross(edge[:, 0], edge[:, 1])
        twice_area = np.linalg.norm(across, axis=1)
        self._end = np.cumsum(density[self._triangle] * twice_area / 2)
        self._edge, self._normal = edge, across / twice_area[:, None]
        self.reach = reach(density)

    @property
    def count(self) -> int:
        return len(self._triangle)

    def sample(self, u: np.ndarray, viewers: np.ndarray) -> EmitterSamples:
        """The points that ``u`` (N, 3) in [0, 1) pick: a triangle by its share of the power, evenly on it. They send
        nothing to ``viewers`` (N or 1, 3) who look at a side that is not there."""
        emitter = np.minimum(np.searchsorted(self._end, u[:, 2], side="right"), self.count - 1)
        root = np.sqrt(u[:, 0])
        barycentric = np.stack([root * (1 - u[:, 1]), root * u[:, 1]], axis=1)
        triangle = self._triangle[emitter]
        point = self.scene.triangles[triangle, 0] + np.einsum("ne,nei->ni", barycentric, self._edge[emitter])
        radiance = self.scene.emission(triangle, barycentric)
        radiance[self.scene.is_hole(triangle, barycentric)] = 0.0
        radiance[self.scene.is_missing_side(triangle, point - viewers)] = 0.0
        return EmitterSamples(point, self._normal[emitter], radiance, self.density[triangle], self._group(triangle))

    def _group(self, triangle: np.ndarray) -> np.ndarray:
        return self.scene.links.group[self.scene.role[triangle]]

    # At surfaces
    # ------------------------------------------------------------------------------------------------------------------

    def irradiance(
        self,
        points: np.ndarray,
        origins: np.ndarray,
        normals: np.ndarray,
        keys: np.ndarray,
        index,
        role: np.ndarray,
        coupling: np.ndarray | None = None,
    ) -> np.ndarray:
        """(N, 3) irradiance at ``points`` (N, 3) by sample ``index`` of the sequences of ``keys`` (N, 3): one point on
        the emitters and one direction about the normal, weighted by the balance heuristic. Rays start at ``origins``
        (N, 3), surfaces have ``role`` (N,) in light linking and take light by their ``coupling`` (N, 4)."""
        return self.by_points(points, origins, normals, keys, index, role, coupling) + self.by_directions(
            origins, normals, keys, index, role, coupling
        )

    def unshadowed(self, points: np.ndarray, normals: np.ndarray, keys: np.ndarray, index, role) -> np.ndarray:
        """(N, 3) irradiance by candidate ``index`` of the sequences of ``keys`` (N, 3) if nothing stands between."""
        return self._arrival(
            self.sample(sample_r3(keys, index).astype(float), points), points, normals, role
        ).irradiance

    def _arrival(
        self,
        emitter: EmitterSamples,
        points: np.ndarray,
        normals: np.ndarray,
        role: np.ndarray,
        coupling: np.ndarray | None = None,
    ) -> _Arrival:
        """What points on the emitters answer for."""
        offset = emitter.point - points
        squared = np.maximum(np.einsum("ni,ni->n", offset, offset), 1e-20)
        distance = np.sqrt(squared)
        direction = offset / distance[:, None]
        surface_cosine = np.maximum(np.einsum("ni,ni->n", direction, normals), 0.0)
        emitter_cosine = np.abs(np.einsum("ni,ni->n", direction, emitter.normal))
        share = self._point_share(emitter.group, emitter.density, distance, surface_cosine, emitter_cosine)
        factor = surface_cosine * emitter_cosine / (squared * emitter.density) * share
        factor = np.where(self.scene.falls_on(emitter.group, role), factor, 0.0)
        irradiance = emitter.radiance * factor[:, None]
        irradiance = irradiance if coupling is None else irradiance * coupled(coupling, surface_cosine)
        return _Arrival(irradiance, emitter.point, emitter.group)

    def _point_share(self, group, density, distance, surface_cosine, emitter_cosine) -> np.ndarray:
        """(N,) share of the light from an emitter that points on emitters answer for; directions about the normal
        answer for the rest, within ``reach``. Not where light of the emitter's ``group`` passes any surface, at which
        directions end."""
        points = CANDIDATES * density * distance * distance
        directions = surface_cosine * emitter_cosine / np.pi
        alone = (distance >= self.reach) | ~self.scene.links.blocks.all(axis=0)[group]
        return np.where(alone, 1.0, points / np.maximum(points + directions, 1e-300))

    def by_points(self, points, origins, normals, keys, index, role, coupling=None) -> np.ndarray:
        """The part of ``irradiance`` that points answer for. Resampled: CANDIDATES points by power, one of them by what
        it would send if nothing stood between; a single number chooses among them one after the other."""
        if not self.count:
            return np.zeros_like(points)
        choice = WeightedChoice(sample_r3(shifted(keys, _CHOICE_STREAM, 0, 0), index)[:, 0])
        best = _Arrival(np.zeros_like(points), np.zeros_like(points), np.zeros(len(points), int))
        for candidate in range(CANDIDATES):
            u = sample_r3(keys, np.asarray(index) * CANDIDATES + candidate).astype(float)
            arrival = self._arrival(self.sample(u, points), points, normals, role, coupling)
            taken = choice.takes(arrival.irradiance.sum(axis=1))
            for name in ("irradiance", "point", "group"):
                getattr(best, name)[taken] = getattr(arrival, name)[taken]
        lit = np.flatnonzero(choice.weight > 0)
        # From where the ray starts, which is not the surface: to an emitter a few centimetres away it would be too long
        # and meet the emitter itself.
        way = best.point[lit] - origins[lit]
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-20)
        visible = np.zeros(len(lit), bool)
        for group in np.unique(best.group[lit]):
            mine = best.group[lit] == group
            ends = length[mine] * _SHADOW_END
            visible[mine] = self.scene.visible(origins[lit[mine]], way[mine] / length[mine, None], ends, group)
        lit = lit[visible]
        result = np.zeros_like(points)
        way, length = way[visible], length[visible]
        tint = self.scene.tint(origins[lit], way / length[:, None], length * _SHADOW_END)
        result[lit] = best.irradiance[lit] * (choice.total[lit] / (choice.weight[lit] * CANDIDATES))[:, None] * tint
        return result

    def by_directions(
        self, origins: np.ndarray, normals: np.ndarray, keys: np.ndarray, index, role, coupling=None
    ) -> np.ndarray:
        """(N, 3) irradiance by one direction about each of ``normals`` (N, 3), which finds emitters within
        ``reach``."""
        u = sample_r2(shifted(keys, 0, _DIRECTION_STREAM, 0), index).astype(float)
        direction = sample_cosine(normals, u)
        hits = self.scene.closest(origins, direction)
        cosine = np.einsum("ni,ni->n", direction, normals)
        share = self.direction_share(hits, direction, cosine, role)
        found = np.flatnonzero(share)
        radiance = self.scene.emission(hits.triangle[found], hits.barycentric[found])
        tint = self.scene.tint(origins[found], direction[found], hits.distance[found], DIFFUSE_RAYS)
        result = np.zeros_like(origins)
        result[found] = radiance * (share[found] * np.pi)[:, None] * tint
        return result if coupling is None else result * coupled(coupling, cosine)

    def direction_share(self, hits: Hits, direction: np.ndarray, cosine: np.ndarray, role: np.ndarray) -> np.ndarray:
        """(N,) share of the emission of sampled emitters among ``hits`` (N) that directions about a normal answer for:
        rays along ``direction`` (N, 3), at ``cosine`` (N,) to the normal, from surfaces of ``role`` (N,)."""
        found = np.flatnonzero(hits.triangle >= 0)
        triangle = hits.triangle[found]
        falls = (self.density[triangle] > 0) & self.scene.falls_on(self._group(triangle), role[found])
        found, triangle = found[falls], triangle[falls]
        edge = self.scene.triangles[triangle, 1:] - self.scene.triangles[triangle, :1]
        normal = np.cross(edge[:, 0], edge[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        emitter_cosine = np.abs(np.einsum("ni,ni->n", direction[found], normal))
        distance = hits.distance[found]
        how = self._group(triangle), self.density[triangle], distance, cosine[found], emitter_cosine
        share = np.zeros(len(direction))
        share[found] = 1.0 - self._point_share(*how)
        return share

    # At probes
    # ------------------------------------------------------------------------------------------------------------------

    def texel_radiance(self, seen: Surfaces, directions: np.ndarray, face: int) -> np.ndarray:
        """(X, 3) radiance of emitters in those of a probe's texels ``seen`` (X) along ``directions`` (X, 3) that answer
        for them: every place on an emitter belongs to texels or to points, whichever are denser as the probe sees it.
        """
        texel = np.flatnonzero(seen.triangle >= 0)
        texel = texel[self.density[seen.triangle[texel]] > 0]
        cosine = np.maximum(np.abs(np.einsum("xi,xi->x", directions[texel], seen.normal[texel])), _LEAST_COSINE)
        density = PROBE_POINTS * self.density[seen.triangle[texel]] * seen.distance[texel] ** 2 / cosine
        texel = texel[density * np.tile(texel_solid_angles(face).ravel(), 6)[texel] < 1.0]
        radiance = np.zeros((len(directions), 3))
        radiance[texel] = seen.emission[texel]
        return radiance

    def seen_points(self, node: int, position: np.ndarray, settings: BakeSettings) -> SeenPoints:
        """Points on emitters that the probe of grid ``node`` at ``position`` (3,) sees and answer for their light."""
        index = np.arange(PROBE_POINTS)
        keys = np.broadcast_to(keys_of(np.array(node), _PROBE_STREAM, settings.seed), (len(index), 3))
        place = sample_r2(keys, index).astype(float)
        jitter = sample_r2(shifted(keys, 1, 0, 0), index)[:, 0].astype(float)
        emitter = self.sample(np.column_stack([place, (index + jitter) / PROBE_POINTS]), position)
        offset = emitter.point - position
        distance = np.sqrt(np.maximum(np.einsum("ni,ni->n", offset, offset), 1e-20))
        direction = offset / distance[:, None]
        cosine = np.maximum(np.abs(np.einsum("ni,ni->n", direction, emitter.normal)), _LEAST_COSINE)
        density = PROBE_POINTS * emitter.density * distance**2 / cosine
        face, row, column = direction_to_texel(direction, settings.face)
        in_texels = density * texel_solid_angles(settings.face)[row, column] < 1.0
        radiance = np.where(in_texels[:, None], 0.0, emitter.radiance / density[:, None])
        weight = radiance.sum(axis=1)
        # One ray each time the running sum of the weights has grown by an equal step.
        step = weight.sum() / PROBE_RAYS
        passed = np.floor(np.cumsum(weight) / (step or 1.0) + 0.5)
        rays = np.diff(passed, prepend=0.0)
        sent = np.flatnonzero(rays)
        origins = np.broadcast_to(position, (len(sent), 3))
        sent = sent[self.scene.visible(origins, direction[sent], distance[sent] * _SHADOW_END)]
        flux = radiance[sent] * (rays[sent] * step / weight[sent])[:, None]
        flux *= self.scene.tint(
            np.broadcast_to(position, (len(sent), 3)), direction[sent], distance[sent] * _SHADOW_END
        )
        return SeenPoints(direction[sent], distance[sent], emitter.normal[sent], flux)
