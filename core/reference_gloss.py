# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays that go on where they are mirrored, readable and slow: the twin of gloss_light_lib.glsl, reflection_lib.glsl and
texel_reflections_comp.glsl. What a glossy surface does: core/gloss.py.

Positions relative to the volume's centre; N rays.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from . import direct_light, rays
from .cubemap import texel_directions
from .emitters import CANDIDATES
from .gloss import (
    LOOKS_A_RAY,
    MOST_REFLECTIONS,
    PATCH_BLUR,
    TEXEL_BLUR,
    TEXEL_RAYS,
    GlossyPlaces,
    Reflections,
    blurred,
    chance_of_mirroring,
    events_of,
    gloss_rows,
    light_keys_of,
    looks_at,
    share_of_points,
    unit_numbers,
)
from .reference_emitters import ReferenceEmitters
from .reference_places import pack
from .reference_scene import ReferenceScene, Surfaces
from .reference_ways import Middle, Ways, beginning
from .sampling import WeightedChoice, keys_of, light_keys, sample_r2, sample_r3, shifted
from .sheets import off_surface
from .snapshot import DIFFUSE_RAYS, Light

_TEXEL_STREAM, _EMITTER_STREAM, _CHOICE_STREAM = 0x165667B1, 0x2545F491, 0x68E31DA4
_PLACE_STREAM = 0x2C1B3C6D
_SHADOW_END = 0.9999  # of the distance to a light


@dataclass
class TexelReflections:
    """What the texels (P, X) of probes mirror by TEXEL_RAYS (K) rays each."""

    diffuse: np.ndarray  # (P, X, 3) albedo of what they send back diffusely
    carried: np.ndarray  # (P, X, 3) radiance that rays brought along
    ways: Ways  # (P·X·K)
    sent: np.ndarray  # (P·X·K, 3) by which part of the irradiance where they end they count

    def ends(self, scene: ReferenceScene) -> tuple[np.ndarray, np.ndarray]:
        """Places (P·X·K, 4) where rays end, and the sheets (P·X·K,) there."""
        lit = self.sent.any(axis=1)
        hits, sheets = np.zeros((len(lit), 4), np.float32), np.where(lit, scene.sheet[self.ways.surface.triangle], 0)
        distance, both_sides = np.where(lit, self.ways.surface.distance, 0.0), scene.sheet_shares[sheets].any(axis=1)
        hits[:, :3] = off_surface(self.ways.position, self.ways.direction, distance, both_sides)
        hits[:, 3] = pack(self.ways.surface.normal, lit)
        hits[~lit, :3] = 0.0
        return hits, sheets


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
            some.throughput /= chance[~diffuse][:, None]
            onwards = places.at(~diffuse)
            width = np.maximum(onwards.alpha, blur)
            some.brought += some.throughput * self.light(onwards, some, width, light_keys_of(events[~diffuse]))
            self.go_on(some, on, width, True, spread)
            ways.put(alive, some)

    def go_on(self, ways: Ways, reflections: Reflections, width: np.ndarray, meets_lamps: bool, spread: float) -> None:
        """``ways`` go on by ``reflections``, out of lobes of ``width`` (N,)."""
        point, origin = ways.position, beginning(ways)
        ways.throughput *= reflections.mirrored
        ways.direction = reflections.direction
        found = self.scene.closest(origin, ways.direction)
        ways.throughput *= self.scene.tint(origin, ways.direction, found.distance, DIFFUSE_RAYS)
        left = ways.surface.triangle
        if meets_lamps:
            met = self._lamps_met(point, ways.direction, found.distance, width, left)
            ways.brought += ways.throughput * met
        ways.surface = self.scene.resolve(found, ways.direction, spread)
        missed = found.triangle < 0
        ways.position = origin + ways.direction * np.where(missed, 0.0, found.distance)[:, None]
        emission = ways.surface.emission * self._share_of_rays(ways, found, width, left)[:, None]
        ways.brought += ways.throughput * np.where(missed[:, None], self._world(ways.direction), emission)
        ways.throughput[missed] = 0.0

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def light(self, places: GlossyPlaces, ways: Ways, width: np.ndarray, keys: np.ndarray) -> np.ndarray:
        """(N, 3) radiance that ``places`` send to their views by light of points on lamps and sampled emitters."""
        light = self._lamps_in_gloss(places, ways, width, keys, np.zeros(len(width), int))
        emitter_keys = shifted(keys, 0, 0, _EMITTER_STREAM)
        return light + self._emitters_in_gloss(places, ways, width, emitter_keys, np.zeros(len(width), int))

    def _lamps_in_gloss(self, places, ways, width, keys, index) -> np.ndarray:
        sum_, origin = np.zeros_like(ways.position), beginning(ways)
        point = ways.position + self.scene.origin
        for number, lamp in enumerate(self._lamps()):
            sample = direct_light.sample_light(lamp, point, sample_r2(light_keys(keys, number), index).astype(float))
            group = lamp.link_group
            share = share_of_points(direct_light.extent(lamp, point), width)[:, None]
            radiance = places.lobe(sample.directions, width) * sample.irradiance * share
            lit = np.flatnonzero(radiance.any(axis=1) & self._falls_on(group, ways.surface.triangle))
            if lamp.casts_shadow:
                way = origin[lit], sample.directions[lit], sample.distances[lit] * _SHADOW_END
                radiance[lit] *= self._arriving(*way, group)
            sum_[lit] += radiance[lit]
        return sum_

    def _emitters_in_gloss(self, places, ways, width, keys, index) -> np.ndarray:
        """Resampled as in ReferenceEmitters."""
        point, origin = ways.position, beginning(ways)
        if not self._emitters.count:
            return np.zeros_like(point)
        choice = WeightedChoice(sample_r3(shifted(keys, _CHOICE_STREAM, 0, 0), index)[:, 0])
        best, best_point, best_group = np.zeros_like(point), np.zeros_like(point), np.zeros(len(point), int)
        for candidate in range(CANDIDATES):
            emitter = self._emitters.sample(sample_r3(keys, index * CANDIDATES + candidate).astype(float), point)
            offset = emitter.point - point
            squared = np.maximum(np.einsum("ni,ni->n", offset, offset), 1e-20)
            direction = offset / np.sqrt(squared)[:, None]
            cosine = np.abs(np.einsum("ni,ni->n", direction, emitter.normal))
            extent = cosine / (CANDIDATES * emitter.density * squared)
            share = share_of_points(np.where(self._passes(emitter.group), 0.0, extent), width)
            share = np.where(self._falls_on(emitter.group, ways.surface.triangle), share, 0.0)
            factor = cosine / (squared * emitter.density) * share
            radiance = emitter.radiance * places.lobe(direction, width) * factor[:, None]
            taken = choice.takes(radiance.sum(axis=1))
            best[taken], best_point[taken] = radiance[taken], emitter.point[taken]
            best_group[taken] = emitter.group[taken]
        result = np.zeros_like(point)
        for group in np.unique(best_group):
            lit = np.flatnonzero((choice.weight > 0) & (best_group == group))
            way = best_point[lit] - origin[lit]
            length = np.maximum(np.linalg.norm(way, axis=1), 1e-20)
            arriving = self._arriving(origin[lit], way / length[:, None], length * _SHADOW_END, group)
            result[lit] = best[lit] * (choice.total[lit] / (choice.weight[lit] * CANDIDATES))[:, None] * arriving
        return result

    def _falls_on(self, group: int | np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """(N,) bool: does light of ``group`` fall on ``triangle`` (N,)?"""
        return self.scene.falls_on(group, self.scene.role[triangle])

    def _passes(self, group: np.ndarray) -> np.ndarray:
        """(N,) bool: is there anything that light of ``group`` (N,) passes?"""
        return ~self.scene.links.blocks.all(axis=0)[group]

    def _arriving(self, origin: np.ndarray, direction: np.ndarray, limit: np.ndarray, group: int) -> np.ndarray:
        """(N, 3) what arrives along rays to emitters of ``group``."""
        visible = self.scene.visible(origin, direction, limit, group)[:, None]
        return visible * self.scene.tint(origin, direction, limit, group=group)

    def _lamps_met(
        self, point: np.ndarray, direction: np.ndarray, limit: np.ndarray, width: np.ndarray, left
    ) -> np.ndarray:
        """(N, 3) radiance of lamps along mirrored rays, by the share that rays answer for."""
        world_point, sum_ = point + self.scene.origin, np.zeros_like(point)
        for lamp in self._lamps():
            share = 1 - share_of_points(direct_light.extent(lamp, world_point), width)[:, None]
            sum_ += (
                direct_light.met(lamp, world_point, direction, limit)
                * share
                * self._falls_on(lamp.link_group, left)[:, None]
            )
        return sum_

    def _share_of_rays(self, ways: Ways, found: rays.Hits, width: np.ndarray, left: np.ndarray) -> np.ndarray:
        """(N,) of the emission of what they met that rays answer for."""
        group = self.scene.links.group[self.scene.role[found.triangle]]
        share = np.where((found.triangle < 0) | self._falls_on(group, left), 1.0, 0.0)
        met = np.flatnonzero((found.triangle >= 0) & (self._emitters.density[found.triangle] > 0))
        if len(met):
            density = self._emitters.density[found.triangle[met]]
            geometric = self.places(ways.at(met)).geometric
            cosine = np.abs(np.einsum("ni,ni->n", ways.direction[met], geometric)) * ~self._passes(group[met])
            share[met] *= 1 - share_of_points(cosine / (CANDIDATES * density * found.distance[met] ** 2), width[met])
        return share

    # Texels
    # ------------------------------------------------------------------------------------------------------------------

    def texels(self, surfaces: Surfaces, positions: np.ndarray, nodes: np.ndarray, face: int, seed: int):
        """What texels mirror that see ``surfaces`` (P, X) from ``positions`` (P, 3), of the probes of grid ``nodes``
        (P,): numbers (R,) of the texels that rays leave, what surfaces send back diffusely beside them (R, 3), the rays
        to their ends; numbers (G,) of all glossy texels and radiance (G, 3) that lamps send by way of them."""
        probes, texels = surfaces.triangle.shape
        glossy = np.flatnonzero(self.is_glossy(surfaces.triangle))
        flat = Surfaces(
            *(value.reshape(probes * texels, *value.shape[2:])[glossy] for value in vars(surfaces).values())
        )
        zero = np.zeros((len(glossy), 3))
        directions = texel_directions(face).reshape(-1, 3)[glossy % texels]
        origin = positions[glossy // texels]
        seen = Ways(directions, flat, origin + directions * flat.distance[:, None], zero + 1, zero.copy())
        middle = Middle(seen, self.places(seen), origin, glossy % texels, face, self.scene)
        width = blurred(middle.places.alpha, TEXEL_BLUR * middle.turn())
        keys = keys_of(nodes[glossy // texels], _TEXEL_STREAM, seed)
        looked = self._lamps_looked_at(middle, width, keys)
        ray = np.tile(np.arange(TEXEL_RAYS), len(glossy))
        each = np.repeat(np.arange(len(glossy)), TEXEL_RAYS)
        diffuse, ways = self._send(middle.at(each), width[each], keys[each], (glossy[each] % texels) * TEXEL_RAYS + ray)
        return glossy[each], diffuse, ways, glossy, looked

    def _lamps_looked_at(self, middle: Middle, width: np.ndarray, keys: np.ndarray) -> np.ndarray:
        """(G, 3) radiance that lamps send to texels by places all over them."""
        looks, sum_ = looks_at(len(self._lamps())), np.zeros_like(middle.origin)
        for first in range(0, looks, LOOKS_A_RAY):
            together = min(LOOKS_A_RAY, looks - first)
            sum_ += self._by_one_look(middle, width, keys, middle.texel * looks + first, together) / looks
        return sum_

    def _by_one_look(
        self, middle: Middle, width: np.ndarray, keys: np.ndarray, first: np.ndarray, looks: int
    ) -> np.ndarray:
        """(G, 3) sum of what ``looks`` from number ``first`` (G,) on bring; the way of one of them, chosen by what it
        brings if nothing stands between, is asked for all."""
        place_keys, light_keys_ = shifted(keys, 0, _PLACE_STREAM, 0), light_keys_of(keys)
        choice = WeightedChoice(sample_r3(place_keys, first)[:, 2])
        seen, light = middle.ways.at(np.arange(len(first))), np.zeros(len(first), int)
        chosen, towards, distance = np.zeros_like(middle.origin), np.zeros_like(middle.origin), np.zeros(len(first))
        for numbers in (first + look for look in range(looks)):
            ways = middle.through(sample_r3(place_keys, numbers))
            for number, *look in self._seen_of_lamps(self.places(ways), ways, width, light_keys_, numbers):
                taken = np.flatnonzero(choice.takes(np.abs(look[0]).sum(axis=1)))
                seen.put(taken, ways.at(taken))
                light[taken] = number
                for of_chosen, value in zip((chosen, towards, distance), look):
                    of_chosen[taken] = value[taken]
        asked = choice.weight > 0
        asked &= ~middle.hides(seen, asked)
        result = chosen * np.where(asked, choice.total / np.where(asked, choice.weight, 1.0), 0.0)[:, None]
        for number, lamp in enumerate(self._lamps()):
            lit = np.flatnonzero(asked & (light == number))
            if lamp.casts_shadow:
                limit = distance[lit] * _SHADOW_END
                result[lit] *= self._arriving(beginning(seen)[lit], towards[lit], limit, lamp.link_group)
        return result

    def _seen_of_lamps(self, places: GlossyPlaces, ways: Ways, width: np.ndarray, keys: np.ndarray, numbers):
        """What a look sees of each lamp if nothing stands between, by a point on it and by a mirrored ray: number of
        the lamp, radiance (G, 3), direction (G, 3), distance (G,)."""
        point = ways.position + self.scene.origin
        on = places.reflect(events_of(keys, numbers, 0), sample_r2(keys, numbers).astype(float))
        for number, lamp in enumerate(self._lamps()):
            falls = self._falls_on(lamp.link_group, ways.surface.triangle)[:, None]
            share = share_of_points(direct_light.extent(lamp, point), width)[:, None]
            sample = direct_light.sample_light(lamp, point, sample_r2(light_keys(keys, number), numbers).astype(float))
            radiance = places.lobe(sample.directions, width) * sample.irradiance * share * falls
            yield number, radiance, sample.directions, sample.distances
            met, distance = direct_light.meeting(lamp, point, on.direction)
            yield number, met * on.mirrored * (1 - share) * falls, on.direction, distance

    def _send(self, middle: Middle, width: np.ndarray, keys: np.ndarray, numbers: np.ndarray):
        ways = middle.through(sample_r3(shifted(keys, 0, _PLACE_STREAM, 1), numbers))
        hidden = np.flatnonzero(middle.hides(ways, np.ones(len(numbers), bool)))
        ways.put(hidden, middle.ways.at(hidden))
        places, events = self.places(ways), events_of(keys, numbers, 0)
        reflections = places.reflect(events, sample_r2(keys, numbers).astype(float))
        emitter_keys = shifted(light_keys_of(keys), 0, 0, _EMITTER_STREAM)
        ways.brought += self._emitters_in_gloss(places, ways, width, emitter_keys, numbers)
        self.go_on(ways, reflections, width, False, 2.0 / middle.face)
        self.follow(ways, keys, numbers, 1, MOST_REFLECTIONS - 1, PATCH_BLUR, 2.0 / middle.face)
        return reflections.diffuse, ways


def texel_reflections(gloss: ReferenceGloss, surfaces: Surfaces, *how) -> TexelReflections:
    """``ReferenceGloss.texels`` for all texels of ``surfaces`` (P, X), with what they send back diffusely."""
    probes, texels = surfaces.triangle.shape
    rays_ = probes * texels * TEXEL_RAYS
    texel, diffuse, found, glossy, looked = gloss.texels(surfaces, *how)
    place = texel * TEXEL_RAYS + np.arange(len(texel)) % TEXEL_RAYS
    nothing = Surfaces(
        np.full(rays_, np.inf), np.full(rays_, -1), np.zeros(rays_, bool), *(np.zeros((rays_, 3)) for _ in range(3))
    )
    ways = Ways(np.zeros((rays_, 3)), nothing, *(np.zeros((rays_, 3)) for _ in range(3)))
    ways.put(place, found)
    albedo = surfaces.albedo.reshape(-1, 3).copy()
    albedo[glossy] = 0.0
    np.add.at(albedo, texel, diffuse / TEXEL_RAYS)
    carried = ways.brought.reshape(probes * texels, TEXEL_RAYS, 3).mean(axis=1)
    carried[glossy] += looked
    shape, sent = (probes, texels, 3), ways.throughput * ways.surface.albedo
    return TexelReflections(albedo.reshape(shape), carried.reshape(shape), ways, sent)
