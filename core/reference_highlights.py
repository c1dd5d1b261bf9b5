# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights, readable and slow: the twin of highlight_looks_lib.glsl, highlight_project_comp.glsl and
patch_highlights_comp.glsl. What they are: core/highlights.py.

Positions relative to the volume's centre; N places.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from . import direct_light
from .conventions import LUMINANCE
from .cubemap import texel_directions
from .faint_gloss import albedo_towards, coupled, couplings, faint_rows
from .gloss import PATCH_BLUR, GlossyPlaces, blurred
from .highlights import (
    EMITTER_LOOKS,
    HIGHLIGHT_BLUR,
    HIGHLIGHT_STREAM,
    LAMP_LOOKS,
    LEAST_SEEN,
    MOST_LOOKS,
    highlights,
    sharp,
)
from .patches import EMITTERS, NO_PATCH, Part
from .reference_emitters import ReferenceEmitters
from .reference_lamps import ReferenceLamps
from .reference_places import split
from .reference_scene import ReferenceScene, Surfaces
from .reference_ways import Middle, Ways
from .sampling import keys_of, sample_cosine, sample_r2, sample_r3, shifted

_RAY_STREAM = 0x85EBCA6B  # of the directions of rays between patches


# Of the light, and of each the irradiance (N, 3) of patches, and their luminance (N,) if nothing stood between.
Parts = Mapping[Part, tuple[np.ndarray, np.ndarray]]
Lit = tuple[np.ndarray, np.ndarray]  # points (N, POINTS, 4) and sheets (N,) of patches, or of texels


@dataclass
class EndedRays:
    """R rays of each of C places with numbers from ``first_key`` on: the patches ``ends`` (C, R) of them, and what part
    of the light there is ``reflected`` (C, R, 3)."""

    ends: np.ndarray
    reflected: np.ndarray
    first_key: int = 0


@dataclass
class _Places:
    """Surfaces with gloss that is sent evenly, and the ``view`` (N, 3) that they are seen from."""

    position: np.ndarray  # (N, 3)
    normal: np.ndarray  # (N, 3)
    view: np.ndarray  # (N, 3)
    rows: np.ndarray  # (N, 3, 4) of faint_rows
    albedo: np.ndarray  # (N, 3) mean
    role: np.ndarray  # (N,) in light linking
    width: np.ndarray  # (N,) α of lobes
    turn: np.ndarray  # (N,) radians, see ``highlights.sharp``

    def at(self, chosen: np.ndarray) -> _Places:
        return _Places(*(value[chosen] for value in vars(self).values()))


@dataclass
class _Looks:
    """Sum of highlights by weight, sum of weights, and whether one of them was sharp, at N places."""

    total: np.ndarray  # (N, 3)
    weights: np.ndarray  # (N,)
    sharp: np.ndarray  # (N,) bool

    @classmethod
    def none(cls, count: int) -> _Looks:
        return cls(np.zeros((count, 3)), np.zeros(count), np.zeros(count, bool))

    def add(self, places: _Places, towards: np.ndarray, irradiance: np.ndarray) -> None:
        """One more look at each of ``places``, to where so much ``irradiance`` (N, 3) comes from."""
        weight = np.abs(irradiance) @ LUMINANCE
        how = places.normal, places.view, towards, places.width
        self.total += weight[:, None] * highlights(places.rows, places.albedo, *how)
        self.weights += weight
        self.sharp |= (weight > 0) & sharp(*how, places.turn)

    def mean(self, whole: np.ndarray) -> np.ndarray:
        """(N, 3) mean highlight: looks that see much less of the light than the patch as a whole, ``whole`` (N,), show
        less of it."""
        weights = np.maximum(self.weights, LEAST_SEEN * whole)
        return self.total / np.where(weights > 0, weights, 1.0)[:, None]


class ReferenceHighlights:
    """Highlights of ``lamps`` and ``emitters``."""

    def __init__(self, scene: ReferenceScene, emitters: ReferenceEmitters, lamps: ReferenceLamps):
        self.scene, self._emitters, self._lamps = scene, emitters, lamps

    @property
    def is_there(self) -> bool:
        return any(material.faint_gloss is not None for material in self.scene.snapshot.materials)

    @property
    def _rows(self) -> np.ndarray:
        return faint_rows([material.faint_gloss for material in self.scene.snapshot.materials]).astype(float)

    def of_texels(
        self,
        surfaces: Surfaces,
        positions: np.ndarray,
        nodes: np.ndarray,
        patch: np.ndarray,
        parts: Parts,
        face: int,
        seed: int,
    ) -> np.ndarray:
        """(P, X, 3) radiance that texels ``surfaces`` (P, X) send beyond the even one to probes at ``positions`` (P,
        3) of grid ``nodes`` (P,), by what ``parts`` of the light (N, 3) do to their ``patch`` (P, X)."""
        probes, texels = surfaces.triangle.shape
        result = np.zeros((probes * texels, 3))
        triangle, patch = surfaces.triangle.ravel(), patch.ravel()
        faint = self._rows[:, 0, :3].any(axis=1)[self.scene.snapshot.material_index[triangle]]
        through = self.scene.sheet_shares[self.scene.sheet[triangle]].any(axis=1)
        some = np.flatnonzero((triangle >= 0) & (patch >= 0) & faint & ~through)
        middle, rows, mean = self._middle(surfaces, positions, some, face)
        turn = middle.turn()
        role = self.scene.role[triangle[some]]
        places = _Places(
            *(middle.ways.position, middle.places.normal, middle.places.view),
            *(rows, mean, role, blurred(rows[:, 2, 3], HIGHLIGHT_BLUR * turn), turn),
        )
        keys = keys_of(nodes[some // texels], HIGHLIGHT_STREAM, seed)
        seen = -np.einsum("ni,ni->n", middle.ways.direction, middle.ways.surface.normal)
        left = middle.ways.surface.albedo / np.maximum(albedo_towards(rows, mean, seen), 1e-9)
        for part, (irradiance, unshadowed) in parts.items():
            found = _Looks.none(len(some))
            least = EMITTER_LOOKS if part == EMITTERS else LAMP_LOOKS
            looking, looks = np.arange(len(some)), np.full(len(some), least)
            for look in range(MOST_LOOKS):
                if look == least:
                    looking = np.flatnonzero(found.sharp)
                    looks[looking] = MOST_LOOKS
                numbers = (some[looking] % texels) * MOST_LOOKS + look
                way = middle.at(looking).through(sample_r3(shifted(keys[looking], 0, 1, 0), numbers))
                at = places.at(looking)
                at.position, at.normal, at.view = way.position, way.surface.normal, -way.direction
                one = self._look(part, at, keys[looking], numbers)
                found.total[looking] += one.total
                found.weights[looking] += one.weights
                found.sharp[looking] |= one.sharp
            result[some] += irradiance[patch[some]] * left * found.mean(looks * unshadowed[patch[some]])
        return result.reshape(probes, texels, 3)

    def _middle(self, surfaces: Surfaces, positions: np.ndarray, some: np.ndarray, face: int):
        """What texels ``some`` (G,) see in their middle, rows of their gloss and their mean albedo."""
        texels = surfaces.triangle.shape[1]
        flat = Surfaces(*(value.reshape(-1, *value.shape[2:])[some] for value in vars(surfaces).values()))
        directions, origin = texel_directions(face).reshape(-1, 3)[some % texels], positions[some // texels]
        even = copy(self.scene)
        even.snapshot = replace(
            self.scene.snapshot, materials=[replace(m, faint_gloss=None) for m in self.scene.snapshot.materials]
        )
        mean = even.resolve(even.closest(origin, directions), directions, 2.0 / face).albedo
        ways = Ways(directions, flat, origin + directions * flat.distance[:, None], 0 * directions, 0 * directions)
        edge = self.scene.triangles[flat.triangle, 1:] - self.scene.triangles[flat.triangle, :1]
        across = np.cross(edge[:, 0], edge[:, 1])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        facing = np.einsum("ni,ni->n", across, -directions)[:, None] < 0
        rows = self._rows[self.scene.snapshot.material_index[flat.triangle]]
        places = GlossyPlaces(rows, mean, flat.normal, np.where(facing, -across, across), -directions)
        return Middle(ways, places, origin, some % texels, face, self.scene), rows, mean

    def of_rays(self, leaving: Lit, patches: Lit, rays: EndedRays, parts: Parts, seed: int) -> np.ndarray:
        """(C, 3) irradiance beyond the even one of ``leaving`` (C), by what their ``rays`` find of the ``parts`` of the
        light at ``patches`` (N). Of mirrors on the way nothing is known."""
        (points, sheets), ends = patches, rays.ends
        count, each = ends.shape
        coupling, albedo, material = self.scene.made_of(*split(points[:, 0]))
        through, flat = self.scene.sheet_shares[sheets].any(axis=1), ends.ravel()
        ray = np.flatnonzero((flat >= 0) & (material[flat] >= 0) & ~through[flat])
        patch, number, end = ray // each, ray % each, flat[ray]
        _, normal = split(leaving[0][patch, number * leaving[0].shape[1] // each % leaving[0].shape[1]])
        normal[self.scene.sheet_shares[leaving[1][patch]].any(axis=1) & (number % 2 == 1)] *= -1
        keys = keys_of(rays.first_key + patch, _RAY_STREAM, seed)
        direction = sample_cosine(normal, sample_r2(keys, number).astype(float))
        position, facing = split(points[end, ray % points.shape[1]])
        rows = self._rows[material[end]]
        cosine = -np.einsum("ni,ni->n", direction, facing)
        width, role = np.maximum(rows[:, 2, 3], PATCH_BLUR), self.scene.sheet_roles[sheets[end]]
        places = _Places(position, facing, -direction, rows, albedo[end], role, width, 0 * width)
        back = rays.reflected.reshape(-1, 3)[ray] / np.maximum(albedo_towards(rows, albedo[end], cosine), 1e-9)
        back[cosine <= 0] = 0.0
        result = np.zeros((count * each, 3))
        for part, (irradiance, unshadowed) in parts.items():
            look = self._look(part, places, shifted(keys, 0, HIGHLIGHT_STREAM, 0), number)
            result[ray] += back * irradiance[end] * np.pi * look.mean(unshadowed[end])
        counted = np.maximum((ends != NO_PATCH).sum(axis=1), 1)
        return result.reshape(count, each, 3).sum(axis=1) / counted[:, None]

    def _look(self, part: Part, places: _Places, keys: np.ndarray, index: np.ndarray) -> _Looks:
        """One look at ``part`` of the light."""
        coupling = couplings(places.rows, places.albedo)
        found = _Looks.none(len(places.position))
        if part == EMITTERS:
            emitter = self._emitters.sample(sample_r3(keys, index).astype(float), places.position)
            offset = emitter.point - places.position
            squared = np.maximum(np.einsum("ni,ni->n", offset, offset), 1e-20)
            towards = offset / np.sqrt(squared)[:, None]
            cosine = np.maximum(np.einsum("ni,ni->n", towards, places.normal), 0.0)
            factor = cosine * np.abs(np.einsum("ni,ni->n", towards, emitter.normal)) / (squared * emitter.density)
            factor = np.where(self.scene.falls_on(emitter.group, places.role), factor, 0.0)
            found.add(places, towards, emitter.radiance * factor[:, None] * coupled(coupling, cosine))
            return found
        u = sample_r2(keys, index).astype(float)
        for lamp in self._lamps.all()[slice(*part)]:
            sample = direct_light.sample_light(lamp, places.position + self.scene.origin, u)
            irradiance = direct_light.unshadowed_irradiance(sample, places.normal)
            irradiance *= self.scene.falls_on(lamp.link_group, places.role)[:, None]
            irradiance *= coupled(coupling, np.einsum("ni,ni->n", sample.directions, places.normal))
            found.add(places, sample.directions, irradiance)
        return found
