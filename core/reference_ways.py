# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays on their way, and places in texels that they go by: for reference_gloss.py."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from .cubemap import place_directions
from .gloss import GlossyPlaces
from .rays import step_off
from .reference_scene import ReferenceScene, Surfaces, interpolate

_SIGHT_END = 0.999  # of the distance to a place in a texel


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
class Middle:
    """What glossy texels (G) see in their middle, and places around it on the planes of the same triangles."""

    ways: Ways
    places: GlossyPlaces
    origin: np.ndarray  # (G, 3) of the probes
    texel: np.ndarray  # (G,) of the probe
    face: int
    scene: ReferenceScene

    def at(self, chosen: np.ndarray) -> Middle:
        ways, places = self.ways.at(chosen), self.places.at(chosen)
        return Middle(ways, places, self.origin[chosen], self.texel[chosen], self.face, self.scene)

    def through(self, place: np.ndarray) -> Ways:
        """The rays through ``place`` (G, 2 or more; 0..1) of the texels; the middle itself where the plane slants."""
        ways = self.ways.at(np.arange(len(self.texel)))
        direction = place_directions(self.texel, place.astype(float), self.face)
        slope = np.einsum("ni,ni->n", self.places.geometric, direction)
        ahead = np.einsum("ni,ni->n", self.places.geometric, ways.position - self.origin)
        distance = ahead / np.where(slope < 0, slope, -1.0)
        on = np.flatnonzero((slope <= -0.01) & (distance <= 2 * ways.surface.distance))
        ways.direction[on], ways.surface.distance[on] = direction[on], distance[on]
        ways.position[on] = self.origin[on] + distance[on, None] * direction[on]
        ways.surface.normal[on] = self._normal(ways.at(on))
        return ways

    def _normal(self, ways: Ways) -> np.ndarray:
        triangle = ways.surface.triangle
        a, b, c = np.moveaxis(self.scene.triangles[triangle], 1, 0)
        across = np.cross(b - a, c - a)
        squared = np.einsum("ni,ni->n", across, across)
        second = np.einsum("ni,ni->n", np.cross(ways.position - a, c - a), across) / squared
        third = np.einsum("ni,ni->n", np.cross(b - a, ways.position - a), across) / squared
        normal = interpolate(self.scene.snapshot.corner_normals[triangle], np.stack([second, third], axis=1))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return np.where(ways.surface.back[:, None], -normal, normal)

    def turn(self) -> np.ndarray:
        """(G,) radians: how far facets that mirror one way turn from one side of a texel to the other."""
        sides = (0.1, 0.5), (0.9, 0.5), (0.5, 0.1), (0.5, 0.9)
        normals = [self.through(np.tile(side, (len(self.texel), 1))).surface.normal for side in sides]
        bends = [np.linalg.norm(normals[i] - normals[i + 1], axis=1) for i in (0, 2)]
        return np.pi / 4 / self.face + 1.25 * np.maximum(*bends)

    def hides(self, ways: Ways, asked: np.ndarray) -> np.ndarray:
        """(G,) bool: is something before those of ``ways`` that are ``asked`` (G,)?"""
        result, ask = np.zeros(len(asked), bool), np.flatnonzero(asked)
        limits = ways.surface.distance[ask] * _SIGHT_END
        result[ask] = ~self.scene.visible(self.origin[ask], ways.direction[ask], limits)
        return result


def beginning(ways: Ways) -> np.ndarray:
    """(N, 3) where rays begin that leave the surfaces that were met."""
    return step_off(ways.position, ways.surface.normal, -ways.direction, ways.surface.distance)


@dataclass
class PatchRays:
    """What rays found: ``hits`` (N, R, 4) position and packed normal, −1 where nothing more can come; ``carried`` (N,
    R, 3) radiance that they brought along; ``reflected`` (N, R, 3) product of the albedos on the way; ``sheets`` (N, R)
    the sheets on which they end."""

    hits: np.ndarray
    carried: np.ndarray
    reflected: np.ndarray
    sheets: np.ndarray

    @property
    def brought(self) -> np.ndarray:
        """(N, 3) irradiance of what the rays of each patch carry."""
        return np.pi * self.carried.mean(axis=1)
