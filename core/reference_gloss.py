# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that go on where they are mirrored, readable and slow: the twin of gloss_light_lib.glsl, reflection_lib.glsl and
texel_reflections_comp.glsl. What a glossy surface does: core/gloss.py.

Positions relative to the volume's centre; N rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from . import direct_light, rays
from .emitters import CANDIDATES
from .gloss import (
    MOST_REFLECTIONS,
    PATCH_BLUR,
    TEXEL_BLUR,
    TEXEL_RAYS,
    GlossyPlaces,
    Reflections,
    chance_of_mirroring,
    events_of,
    gloss_rows,
    light_keys_of,
    share_of_points,
    unit_numbers,
)
from .rays import step_off
from .reference_emitters import ReferenceEmitters
from .reference_scene import ReferenceScene, Surfaces
from .sampling import keys_of, light_keys, sample_r2, sample_r3, shifted
from .snapshot import Light

_TEXEL_STREAM, _EMITTER_STREAM, _CHOICE_STREAM = 0x165667B1, 0x2545F491, 0x68E31DA4
_SHADOW_END = 0.9999  # of the distance to a light


@dataclass
class Ways:
    """Rays that have met ``surface``: its ``position``, what part of what it sends counts, what was brought along."""

    direction: np.ndarray  # (N, 3)
    surface: Surfaces  # (N)
    position: np.ndarray  # (N, 3)
    throughput: np.ndarray  # (N, 3), 0 where nothing more can come
    brought: np.ndarray  # (N, 3)

    def at(self, chosen: np.ndarray) -> Ways:
        return Ways(
            self.direction[chosen],
            Surfaces(*(value[chosen] for value in vars(self.surface).values())),
            self.position[chosen],
            self.throughput[chosen],
            self.brought[chosen],
        )

    def put(self, chosen: np.ndarray, ways: Ways) -> None:
        for field in fields(Surfaces):
            getattr(self.surface, field.name)[chosen] = getattr(ways.surface, field.name)
        for name in ("direction", "position", "throughput", "brought"):
            getattr(self, name)[chosen] = getattr(ways, name)


@dataclass
class TexelReflections:
    """What the texels (P, X) of probes mirror by TEXEL_RAYS (K) rays each."""

    diffuse: np.ndarray  # (P, X, 3) albedo of what they send back diffusely
    carried: np.ndarray  # (P, X, 3) radiance that rays brought along
    ways: Ways  # (P·X·K)
    sent: np.ndarray  # (P·X·K, 3) by which part of the irradiance where they end they count


class ReferenceGloss:
    """``world(directions)`` is the radiance of the background; ``lamps``: with suns of the world."""

    def __init__(
        self,
        scene: ReferenceScene,
        emitters: ReferenceEmitters,
        lamps: Callable[[], list[Light]],
        world: Callable[[np.ndarray], np.ndarray],
    ):
        self.scene, self._emitters, self._lamps, self._world = scene, emitters, lamps, world
        self._rows = gloss_rows([material.gloss for material in scene.snapshot.materials]).astype(float)

    @property
    def is_there(self) -> bool:
        return bool(self._rows[:, 0, :3].any())

    def is_glossy(self, triangle: np.ndarray) -> np.ndarray:
        """(…) bool of triangles (…), False for −1."""
        glossy = self._rows[:, 0, :3].any(axis=1)[self.scene.snapshot.material_index]
        return (triangle >= 0) & glossy[triangle]

    def places(self, ways: Ways) -> GlossyPlaces:
        triangle = ways.surface.triangle
        edge = self.scene.triangles[triangle, 1:] - self.scene.triangles[triangle, :1]
        across = np.cross(edge[:, 0], edge[:, 1])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        facing = np.einsum("ni,ni->n", across, -ways.direction)[:, None] < 0
        rows = self._rows[self.scene.snapshot.material_index[triangle]]
        albedo, normal = ways.surface.albedo, ways.surface.normal
        return GlossyPlaces(rows, albedo, normal, np.where(facing, -across, across), -ways.direction)

    # Rays
    # ------------------------------------------------------------------------------------------------------------------

    def follow(
        self, ways: Ways, keys: np.ndarray, numbers: np.ndarray, first: int, most: int, blur: float, spread: float
    ) -> None:
        """Follows ``ways``, rays ``numbers`` (N,) of ``keys`` (N, 3) whose reflections count from ``first`` on,
        ``most`` of them at most. Where they end, albedo is what is found sent diffusely."""
        alive = np.arange(len(numbers))
        for depth in range(first, first + most):
            alive = alive[ways.throughput[alive].any(axis=1) & self.is_glossy(ways.surface.triangle[alive])]
            if not len(alive):
                return
            events = events_of(keys[alive], numbers[alive], depth)
            places, random = self.places(ways.at(alive)), unit_numbers(events)
            reflections = places.reflect(events, random[:, 1:])
            chance = chance_of_mirroring(reflections)
            diffuse = random[:, 0] >= chance
            ended = alive[diffuse]
            ways.surface.albedo[ended] = reflections.diffuse[diffuse] / (1 - chance[diffuse])[:, None]
            alive = alive[~diffuse]
            on = Reflections(*(value[~diffuse] for value in vars(reflections).values()))
            some = ways.at(alive)
            self.go_on(some, places.at(~diffuse), on, chance[~diffuse], events[~diffuse], blur, spread)
            ways.put(alive, some)

    def go_on(
        self,
        ways: Ways,
        places: GlossyPlaces,
        reflections: Reflections,
        chance: np.ndarray,
        events: np.ndarray,
        blur: float,
        spread: float,
    ) -> None:
        """``ways`` go on from ``places`` by ``reflections``, which they do with ``chance`` (N,)."""
        point = ways.position
        origin = step_off(point, places.normal, places.view, ways.surface.distance)
        weight = ways.throughput / chance[:, None]
        ways.brought += weight * self.light(places, point, origin, blur, light_keys_of(events))
        ways.throughput = weight * reflections.mirrored
        ways.direction = reflections.direction
        found = self.scene.closest(origin, ways.direction)
        ways.brought += ways.throughput * self._lamps_met(point, ways.direction, found.distance)
        ways.surface = self.scene.resolve(found, ways.direction, spread)
        missed = found.triangle < 0
        ways.position = origin + ways.direction * np.where(missed, 0.0, found.distance)[:, None]
        emission = ways.surface.emission * self._share_of_rays(ways, found)[:, None]
        ways.brought += ways.throughput * np.where(missed[:, None], self._world(ways.direction), emission)
        ways.throughput[missed] = 0.0

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def light(
        self, places: GlossyPlaces, point: np.ndarray, origin: np.ndarray, blur: float, keys: np.ndarray
    ) -> np.ndarray:
        """(N, 3) radiance that places send to their views by light of points on lamps and sampled emitters."""
        sum_ = np.zeros_like(point)
        world_point = point + self.scene.origin
        for number, lamp in enumerate(self._lamps()):
            sample = direct_light.sample_light(lamp, world_point, sample_r2(light_keys(keys, number), 0).astype(float))
            share = share_of_points(direct_light.extent(lamp, world_point))[:, None]
            radiance = places.lobe(sample.directions, blur) * sample.irradiance * share
            lit = radiance.any(axis=1)
            if lamp.casts_shadow:
                ends = sample.distances[lit] * _SHADOW_END
                lit[lit] = self.scene.visible(origin[lit], sample.directions[lit], ends)
            sum_[lit] += radiance[lit]
        if self._emitters.count:
            sum_ += self._points_on_emitters(places, point, origin, blur, shifted(keys, 0, 0, _EMITTER_STREAM))
        return sum_

    def _points_on_emitters(self, places, point, origin, blur, keys) -> np.ndarray:
        """Resampled as in ReferenceEmitters."""
        choice = sample_r3(shifted(keys, _CHOICE_STREAM, 0, 0), 0)[:, 0].astype(float)
        best, best_point = np.zeros_like(point), np.zeros_like(point)
        best_weight, total = np.zeros(len(point)), np.zeros(len(point))
        for candidate in range(CANDIDATES):
            emitter = self._emitters.sample(sample_r3(keys, candidate).astype(float))
            offset = emitter.point - point
            squared = np.maximum(np.einsum("ni,ni->n", offset, offset), 1e-20)
            direction = offset / np.sqrt(squared)[:, None]
            cosine = np.abs(np.einsum("ni,ni->n", direction, emitter.normal))
            share = share_of_points(cosine / (CANDIDATES * emitter.density * squared))
            factor = cosine / (squared * emitter.density) * share
            radiance = emitter.radiance * places.lobe(direction, blur) * factor[:, None]
            weight = radiance.sum(axis=1)
            total += weight
            taken = (weight > 0) & (choice * total < weight)
            left = ~taken & (total > weight)
            choice[taken] *= total[taken] / weight[taken]
            choice[left] = (choice[left] * total[left] - weight[left]) / (total[left] - weight[left])
            best[taken], best_point[taken], best_weight[taken] = radiance[taken], emitter.point[taken], weight[taken]
        lit = np.flatnonzero(best_weight > 0)
        way = best_point[lit] - origin[lit]
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-20)
        lit = lit[self.scene.visible(origin[lit], way / length[:, None], length * _SHADOW_END)]
        result = np.zeros_like(point)
        result[lit] = best[lit] * (total[lit] / (best_weight[lit] * CANDIDATES))[:, None]
        return result

    def _lamps_met(self, point: np.ndarray, direction: np.ndarray, limit: np.ndarray) -> np.ndarray:
        """(N, 3) radiance of lamps along mirrored rays, by the share that rays answer for."""
        world_point, sum_ = point + self.scene.origin, np.zeros_like(point)
        for lamp in self._lamps():
            share = 1 - share_of_points(direct_light.extent(lamp, world_point))[:, None]
            sum_ += direct_light.met(lamp, world_point, direction, limit) * share
        return sum_

    def _share_of_rays(self, ways: Ways, found: rays.Hits) -> np.ndarray:
        """(N,) of the emission of what they met that rays answer for."""
        share = np.ones(len(found.triangle))
        met = np.flatnonzero((found.triangle >= 0) & (self._emitters.density[found.triangle] > 0))
        if len(met):
            density = self._emitters.density[found.triangle[met]]
            geometric = self.places(ways.at(met)).geometric
            cosine = np.abs(np.einsum("ni,ni->n", ways.direction[met], geometric))
            share[met] = 1 - share_of_points(cosine / (CANDIDATES * density * found.distance[met] ** 2))
        return share

    # Texels
    # ------------------------------------------------------------------------------------------------------------------

    def texels(
        self, surfaces: Surfaces, points: np.ndarray, directions: np.ndarray, nodes: np.ndarray, face: int, seed: int
    ):
        """What texels mirror that see ``surfaces`` (P, X) at ``points`` (P, X, 3) along ``directions`` (X, 3), of the
        probes of grid ``nodes`` (P,)."""
        probes, texels = surfaces.triangle.shape
        glossy = np.repeat(np.flatnonzero(self.is_glossy(surfaces.triangle)), TEXEL_RAYS)
        ray = np.arange(len(glossy)) % TEXEL_RAYS
        keys = keys_of(nodes[glossy // texels], _TEXEL_STREAM, seed)
        numbers = (glossy % texels) * TEXEL_RAYS + ray
        flat = Surfaces(
            *(value.reshape(probes * texels, *value.shape[2:])[glossy] for value in vars(surfaces).values())
        )
        zero = np.zeros((len(glossy), 3))
        ways = Ways(directions[glossy % texels].copy(), flat, points.reshape(-1, 3)[glossy], zero + 1, zero.copy())
        places, events = self.places(ways), events_of(keys, numbers, 0)
        reflections = places.reflect(events, sample_r2(keys, numbers).astype(float))
        self.go_on(ways, places, reflections, np.ones(len(glossy)), events, TEXEL_BLUR, 2.0 / face)
        self.follow(ways, keys, numbers, 1, MOST_REFLECTIONS - 1, PATCH_BLUR, 2.0 / face)
        return glossy, reflections.diffuse, ways


def texel_reflections(gloss: ReferenceGloss, surfaces: Surfaces, *how) -> TexelReflections:
    """``ReferenceGloss.texels`` for all texels of ``surfaces`` (P, X), with what they send back diffusely."""
    probes, texels = surfaces.triangle.shape
    rays_ = probes * texels * TEXEL_RAYS
    glossy, diffuse, found = gloss.texels(surfaces, *how)
    place = glossy * TEXEL_RAYS + np.arange(len(glossy)) % TEXEL_RAYS
    nothing = Surfaces(
        np.full(rays_, np.inf), np.full(rays_, -1), np.zeros(rays_, bool), *(np.zeros((rays_, 3)) for _ in range(3))
    )
    ways = Ways(np.zeros((rays_, 3)), nothing, *(np.zeros((rays_, 3)) for _ in range(3)))
    ways.put(place, found)
    albedo = surfaces.albedo.reshape(-1, 3).copy()
    albedo[glossy] = 0.0
    np.add.at(albedo, glossy, diffuse / TEXEL_RAYS)
    carried = ways.brought.reshape(probes, texels, TEXEL_RAYS, 3).mean(axis=2)
    return TexelReflections(albedo.reshape(probes, texels, 3), carried, ways, ways.throughput * ways.surface.albedo)
