# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light of patches on the GPU, kept apart by what sends it: each lamp, and all sampled emitters together.

When a lamp changes, only its shadow rays are traced again, and those of patches that now get another number of samples:
that depends on how unevenly a lamp lights a patch, held against the mean light of all.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import gpu
import numpy as np

from ..core.patches import ALL, EMITTERS, POINTS, SAMPLES, Part, direct_samples, light_parts
from ..core.settings import BakeSettings
from ..core.steps import Pace, Steps
from .dispatch import dispatch_linear
from .programs import program
from .scene_textures import SceneTextures
from .textures import allocate, read, upload

_SAMPLES_EACH = 16  # of one lamp, or of emitters, that a thread takes
_LAMPS_AT_ONCE = 32  # that a thread takes
_THREADS_AT_ONCE = 1 << 20
_UNLIT = -1  # in place of an index into SAMPLES


@dataclass
class _PartLight:
    """What one part of the light does to N patches."""

    values: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.float32))  # (N, 4) irradiance
    mean: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))  # (N,) if nothing stood between
    deviation: np.ndarray = field(default_factory=lambda: np.zeros(0, np.float32))  # (N,) over a patch's points
    sample_class: np.ndarray = field(
        default_factory=lambda: np.zeros(0, np.int8)
    )  # (N,) that ``values`` were taken with

    def grow(self, mean: np.ndarray, deviation: np.ndarray) -> None:
        """Adds patches that are not lit yet."""
        count = len(mean)
        self.values = np.concatenate([self.values, np.zeros((count, 4), np.float32)])
        self.mean = np.concatenate([self.mean, mean])
        self.deviation = np.concatenate([self.deviation, deviation])
        self.sample_class = np.concatenate([self.sample_class, np.full(count, _UNLIT, np.int8)])


class PatchDirect:
    """``values`` (N, 4) float32 is the irradiance of all patches lit so far, ``texture`` the same on the GPU."""

    def __init__(self, scene: SceneTextures, settings: BakeSettings, pace: Pace):
        self.effort = 1  # by which SAMPLES are multiplied
        self._scene, self._settings, self._pace = scene, settings, pace
        self._together: list[tuple[int, int]] = []  # ranges of patches, each with its own mean light
        self._parts: dict[Part, _PartLight] = {}
        self._sum()

    @property
    def count(self) -> int:
        """Patches lit so far."""
        return self._together[-1][1] if self._together else 0

    def add(self, points: gpu.types.GPUTexture, count: int) -> Steps[None]:
        """Lights those of ``count`` patches with ``points`` (see PatchFinder) that are not lit yet, in steps."""
        fresh = (self.count, count)
        self._together.append(fresh)
        for part in self._wanted_parts():
            self._parts.setdefault(part, _PartLight()).grow(*self.spread(part, points, *fresh))
            yield
        yield from self._light_what_is_due(points)

    def again(self, points: gpu.types.GPUTexture, changed: np.ndarray, emitters: bool) -> Steps[int]:
        """Direct light where lamps ``changed`` (lamp_count,) bool, or all sampled ``emitters``, or came or left, in
        steps.

        Returns the number of lamps that were lit from nothing.
        """
        before, self._parts, lamps = self._parts, {}, 0
        for part in self._wanted_parts():
            differs = emitters if part == EMITTERS else changed[slice(*part)].any()
            if part in before and not differs:
                self._parts[part] = before[part]
                continue
            self._parts[part] = _PartLight()
            self._parts[part].grow(*self.spread(part, points, 0, self.count))
            lamps += 0 if part == EMITTERS else part[1] - part[0]
            yield
        yield from self._light_what_is_due(points)
        return lamps

    def _wanted_parts(self) -> list[Part]:
        return light_parts(self._scene.lamp_count, self._scene.emitter_count > 0)

    def _light_what_is_due(self, points: gpu.types.GPUTexture) -> Steps[None]:
        """Patches that were not lit, or with another number of samples than they should have."""
        for part, light in self._parts.items():
            wanted = np.empty(self.count, np.int8)
            for first, stop in self._together:
                mean_light = float(sum(other.mean[first:stop].mean() for other in self._parts.values()))
                wanted[first:stop] = direct_samples(light.deviation[first:stop], mean_light)
            due = np.flatnonzero(wanted != light.sample_class)
            if len(due):
                target = allocate(self.count, "patches")
                for index, samples in enumerate(SAMPLES):
                    chosen = due[wanted[due] == index]
                    yield from self.light(points, POINTS, chosen, samples * self.effort, target, part=part)
                light.values[due] = read(target, self.count)[due]
                light.sample_class = wanted
        self._sum()

    def _sum(self) -> None:
        self.values = sum((light.values for light in self._parts.values()), np.zeros((self.count, 4), np.float32))
        self.texture = upload(self.values, "patches")

    def spread(self, part: Part, points: gpu.types.GPUTexture, first: int, stop: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (stop − first,) of the luminance at the points of patches if nothing stands
        between."""
        count = stop - first
        shader = program("patch_spread_comp", POINTS=POINTS, **self._defines(part))
        result = allocate(count, "patches")
        self._bind(shader, part)
        shader.uniform_sampler("patch_points", points)
        shader.image("spread", result)
        for name, value in (("first_patch", first), ("patch_count", count), ("seed", self._settings.seed)):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, count)
        return tuple(read(result, count)[:, :2].T)

    def light(
        self, points, points_each: int, chosen: np.ndarray, samples: int, target, first_key: int = 0, part: Part = ALL
    ) -> Steps[None]:
        """Adds direct light by ``part`` of patches or texels ``chosen`` (L,) with ``points_each`` places in ``points``
        to ``target``, in steps."""
        for portion in self._portions(part):
            lamps = 1 if portion == EMITTERS else portion[1] - portion[0]
            samples_each = max(1, _SAMPLES_EACH // lamps)
            at_once = max(1, _THREADS_AT_ONCE // -(-samples // samples_each))

            def light(start: int, number: int, portion=portion, samples_each=samples_each) -> None:
                some = chosen[start : start + number]
                self._light_portion(portion, points, points_each, some, samples, samples_each, target, first_key)

            yield from self._pace.portions(f"direct {samples}", len(chosen), light, 1024, at_once)

    def _portions(self, part: Part) -> list[Part]:
        """``part`` in portions small enough for one thread, see patch_direct_comp.glsl."""
        if part == EMITTERS:
            return [EMITTERS]
        first, stop = (0, self._scene.lamp_count) if part == ALL else part
        portions = [(at, min(at + _LAMPS_AT_ONCE, stop)) for at in range(first, stop, _LAMPS_AT_ONCE)]
        return [*portions, EMITTERS] if part == ALL and self._scene.emitter_count else portions

    def _light_portion(
        self, part: Part, points, points_each: int, chosen, samples: int, samples_each: int, target, first_key: int
    ) -> None:
        rows = np.zeros((len(chosen), 4), np.float32)
        rows[:, 0] = chosen
        patches = upload(rows, "patches")
        runs = -(-samples // samples_each)
        sums = allocate(len(chosen) * runs, "patches")
        shader = program("patch_direct_comp", POINTS=points_each, SAMPLES_EACH=samples_each, **self._defines(part))
        self._bind(shader, part)
        shader.uniform_sampler("patches", patches)
        shader.uniform_sampler("patch_points", points)
        shader.image("sums", sums)
        for name, value in (
            ("patch_count", len(chosen)),
            ("runs", runs),
            ("first_key", first_key),
            ("samples", samples),
            ("seed", self._settings.seed),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, len(chosen) * runs)
        shader = program("patch_mean_comp")
        shader.uniform_sampler("patches", patches)
        shader.uniform_sampler("sums", sums)
        shader.image("direct", target)
        for name, value in (("patch_count", len(chosen)), ("runs", runs), ("samples", samples)):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, len(chosen))

    def _defines(self, part: Part) -> dict:
        return self._scene.light_defines if part == EMITTERS else self._scene.ray_defines

    def _bind(self, shader, part: Part) -> None:
        (self._scene.bind_lights if part == EMITTERS else self._scene.bind_lamps)(shader)
        first, stop = (0, 0) if part == EMITTERS else part
        shader.uniform_int("first_light", (first,))
        shader.uniform_int("light_count", (stop,))
