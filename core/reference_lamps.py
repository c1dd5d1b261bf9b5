# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps at surfaces, as direct_light_lib.glsl's lamps_irradiance does it: many share a shadow ray.

C places, M of their keys; float64.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from . import direct_light
from .faint_gloss import coupled
from .patches import ALL, Part, lamps_a_ray
from .reference_scene import ReferenceScene
from .sampling import WeightedChoice, light_keys, sample_r2, sample_r3
from .snapshot import Light


class ReferenceLamps:
    """Lamps of ``scene``, as it is when asked, and ``suns`` of its world."""

    def __init__(self, scene: ReferenceScene, suns: list[Light]):
        self.scene, self._suns = scene, suns

    def all(self) -> list[Light]:
        return [*self.scene.snapshot.lights, *self._suns]

    @property
    def count(self) -> int:
        return len(self.all())

    def irradiance(self, points, origins, normals, keys, index, role, coupling, part: Part = ALL) -> np.ndarray:
        """(C, 3) irradiance by ``part`` of the lamps at ``points`` (C, 3), of sample ``index`` of the sequences of
        ``keys`` (C, 3), on surfaces of ``role`` (C,) with ``normals`` (C, 3) that take light by their ``coupling``
        (C, 4). Rays start at ``origins`` (C, 3)."""
        total = np.zeros_like(points)
        for some in self._sharing_rays(part):
            total += self._by_one_ray(some, points, origins, normals, keys, index, role, coupling)
        return total

    def unshadowed(self, points, normals, keys, index, role, part: Part = ALL) -> np.ndarray:
        """(C, 3) likewise if nothing stands between."""
        total = np.zeros_like(points)
        for some in self._sharing_rays(part):
            u = _numbers(some, keys, index)
            for number in some:
                total += self._unshadowed(self.all()[number], self._sample(number, points, u), normals, role)
        return total

    def _sharing_rays(self, part: Part) -> list[range]:
        each = lamps_a_ray(self.count)
        first, stop = part if isinstance(part, tuple) else (0, self.count)
        return [range(at, min(at + each, stop)) for at in range(first, stop, each)]

    def _by_one_ray(self, some: range, points, origins, normals, keys, index, role, coupling) -> np.ndarray:
        """Of ``some`` lamps, one ray to one of them, chosen by what each sends if nothing stands between (Talbot, Cline
        and Egbert, "Importance Resampling for Global Illumination", EGSR 2005, with every lamp a candidate)."""
        u = _numbers(some, keys, index)
        choice = WeightedChoice(u[:, 2])
        chosen, best = np.full(len(points), -1), np.zeros_like(points)
        samples = {number: self._sample(number, points, u) for number in some}
        for number, sample in samples.items():
            sent = self._unshadowed(self.all()[number], sample, normals, role)
            sent *= coupled(coupling, np.einsum("ni,ni->n", sample.directions, normals))
            taken = choice.takes(np.abs(sent).sum(axis=1))
            chosen[taken], best[taken] = number, sent[taken]
        for number in np.unique(chosen[chosen >= 0]):
            lamp, sample, mine = self.all()[number], samples[number], chosen == number
            visible = partial(self.scene.visible, group=lamp.link_group)
            best[mine] *= (choice.total[mine] / choice.weight[mine])[:, None]
            best[mine] *= direct_light.arrives(lamp, sample, origins, mine, visible)[:, None]
            if lamp.casts_shadow:
                way = origins[mine], sample.directions[mine], sample.distances[mine]
                best[mine] *= self.scene.tint(*way, group=lamp.link_group)
        return best

    def _sample(self, number: int, points: np.ndarray, u: np.ndarray) -> direct_light.LightSamples:
        return direct_light.sample_light(self.all()[number], points + self.scene.origin, u[:, :2])

    def _unshadowed(self, lamp: Light, sample: direct_light.LightSamples, normals, role) -> np.ndarray:
        falls = self.scene.falls_on(lamp.link_group, role)[:, None]
        return np.where(falls, direct_light.unshadowed_irradiance(sample, normals), 0.0)


def _numbers(lamps: range, keys: np.ndarray, index) -> np.ndarray:
    """(C, 3) in [0, 1): the place on each of ``lamps``, and which one is chosen."""
    keys = light_keys(keys, lamps.start)
    if len(lamps) > 1:
        return sample_r3(keys, index).astype(float)
    return np.hstack([sample_r2(keys, index), np.zeros((len(keys), 1))]).astype(float)
