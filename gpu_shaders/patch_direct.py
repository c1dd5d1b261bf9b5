# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light of patches on the GPU, kept apart by what sends it: each lamp, and all sampled emitters together.

When a lamp changes, only its shadow rays are traced again, and those of patches that now get another number of samples:
that depends on how unevenly a lamp lights a patch, held against the mean light of all.
"""

from __future__ import annotations

import gpu
import numpy as np

from ..core.patches import ALL, EMITTERS, SAMPLES, Part, lamps_a_ray, light_parts, spread_points
from ..core.settings import BakeSettings
from ..core.steps import Pace, Steps
from .dispatch import compaction_groups, compaction_run, dispatch_linear, is_software
from .elements import fill_elements
from .growing_array import GrowingArray, Scratch
from .places import Places
from .programs import program
from .scene_textures import SceneTextures
from .textures import read

_SAMPLES_EACH = 2  # of one lamp, or of emitters, that a thread takes in software
_POINTS_SIDE_BY_SIDE = 4  # of a patch on a GPU, where few patches are lit as long as one takes
_LAMPS_AT_ONCE = 32  # that a thread takes, where each gets a ray
_SAMPLES_AT_ONCE = 1 << 20
_MOST_LISTS, _MOST_TERMS = 4, 4  # that a shader takes
_FEW_PATCHES = 1 << 18  # up to which all parts are listed at once: of more an array could not hold the lists
_UNLIT = -1  # in place of an index into SAMPLES

_List = tuple[int, int, int]  # of patches: its first entry in an array of them, its entries, samples that each gets


class _PartLight:
    """What one part of the light does to N patches, as arrays of an element a patch."""

    def __init__(self) -> None:
        self.values = GrowingArray("patches")  # irradiance
        self.spread = GrowingArray("patches", "RG32F")  # mean and deviation over the points if nothing stood between
        self.classes = GrowingArray("patches", "R32F")  # index into SAMPLES that ``values`` were taken with

    def grow(self, first: int, stop: int) -> None:
        """Adds patches ``first`` .. ``stop``, or begins again with them; they are not lit yet."""
        for array in (self.values, self.spread, self.classes):
            array.reserve(stop)
        fill_elements(self.classes.texture, first, stop - first, _UNLIT)


class PatchDirect:
    """``texture`` is the irradiance of all patches lit so far, an element a patch."""

    def __init__(self, scene: SceneTextures, settings: BakeSettings, pace: Pace):
        self.effort = 1  # by which SAMPLES are multiplied
        self._scene, self._settings, self._pace = scene, settings, pace
        self._together: list[tuple[int, int]] = []  # ranges of patches, each with its own mean light
        self._parts: dict[Part, _PartLight] = {}
        self._total = GrowingArray("patches")
        self._total.reserve(0)
        self._mean_lights = GrowingArray("patches", "R32F")
        self.scratch = Scratch()

    @property
    def count(self) -> int:
        """Patches lit so far."""
        return self._together[-1][1] if self._together else 0

    @property
    def texture(self) -> gpu.types.GPUTexture:
        return self._total.texture

    def by_part(self) -> list[tuple[Part, gpu.types.GPUTexture, gpu.types.GPUTexture]]:
        """The parts of the light, and of each the irradiance and how unevenly it would fall if nothing stood between
        (see ``find_spread``), an element a patch."""
        return [(part, light.values.texture, light.spread.texture) for part, light in self._parts.items()]

    def add(self, places: Places, count: int) -> Steps[None]:
        """Lights those of ``count`` patches at ``places`` that are not lit yet, in steps."""
        fresh = (self.count, count)
        self._together.append(fresh)
        for part in self._wanted_parts():
            light = self._parts.setdefault(part, _PartLight())
            light.grow(*fresh)
            self.find_spread(part, places, *fresh, light.spread.texture)
            yield
        yield from self._light_what_is_due(places)

    def again(self, places: Places, changed: np.ndarray, emitters: bool) -> Steps[int]:
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
            light = self._parts[part] = before.get(part) or _PartLight()
            light.grow(0, self.count)
            self.find_spread(part, places, 0, self.count, light.spread.texture)
            lamps += part[1] - part[0] if isinstance(part, tuple) else 0
            yield
        yield from self._light_what_is_due(places)
        return lamps

    @property
    def _lamps_a_ray(self) -> int:
        return lamps_a_ray(self._scene.lamp_count)

    def _wanted_parts(self) -> list[Part]:
        return light_parts(self._scene.lamp_count, self._scene.emitter_count > 0)

    # How many samples
    # ------------------------------------------------------------------------------------------------------------------

    def _light_what_is_due(self, places: Places) -> Steps[None]:
        """Patches that were not lit, or with another number of samples than they should have."""
        if not self._parts:
            self._add_up()
            return
        lights, parts = self._lights_together(), list(self._parts.items())
        at_once, classes = _MOST_TERMS if self.count <= _FEW_PATCHES else 1, len(SAMPLES)
        counts = self.scratch("counts", len(parts) * classes, "patches", "R32F")
        lists = []  # of each part: an array, and where in it its lists begin
        for first in range(0, len(parts), at_once):
            some = [light for _part, light in parts[first : first + at_once]]
            due = self._list_due(some, lights, counts, first)
            lists += [(due, row * classes * self.count) for row in range(len(some))]
        lengths = read(counts, len(parts) * classes, channels=1).reshape(-1, classes).astype(int)
        for (part, light), (due, begin), numbers in zip(parts, lists, lengths.tolist()):
            entries = [
                (begin + index * self.count, number, samples * self.effort)
                for index, (number, samples) in enumerate(zip(numbers, SAMPLES))
            ]
            yield from self.light(places, due, entries, light.values.texture, part=part)
        self._add_up()

    def _lights_together(self) -> gpu.types.GPUTexture:
        """What errors are held against: the mean that all parts send to each patch, and in ``_mean_lights`` the mean of
        that by range of patches."""
        lights = self.scratch("lights", self.count, "patches")
        sums = self.scratch("sums of lights", len(self._together), "patches", "R32F")
        add_patches(lights, self.count, [light.spread.texture for light in self._parts.values()])
        target = self._mean_lights.reserve(self.count)
        for row, (first, stop) in enumerate(self._together):
            reduce_patches(lights, first, stop, sums, row)
            fill_elements(target, first, stop - first, 1.0 / max(stop - first, 1), factor=(sums, row))
        return lights

    def _list_due(self, parts: list[_PartLight], lights, counts, first: int) -> gpu.types.GPUTexture:
        """Patches that each of ``parts``, of which the first is number ``first``, should light with each of SAMPLES and
        has not yet, marked as lit so: lists of ``count`` elements one after the other. Their lengths go into
        ``counts``, len(SAMPLES) elements a part."""
        blocks, lists = max(compaction_groups(self.count), 1), len(parts) * len(SAMPLES)
        block_counts = self.scratch("block counts", blocks * lists, "patches", "R32F")
        due = self.scratch(f"due {first}", self.count * lists, "patches", "R32F")
        for name in ("compact_count_comp", "patch_due_comp"):
            if name == "compact_count_comp" and blocks == 1:
                continue
            shader = program(name, PARTS=len(parts), RUN=compaction_run())
            for number, light in enumerate(parts):
                shader.uniform_sampler(f"spread{number}", light.spread.texture)
                shader.image(f"classes{number}", light.classes.texture)
            shader.uniform_sampler("lights", lights)
            shader.uniform_sampler("mean_lights", self._mean_lights.texture)
            shader.uniform_int("patch_count", (self.count,))
            if name == "compact_count_comp":
                shader.image("block_counts", block_counts)
            else:
                shader.uniform_sampler("block_counts", block_counts)
                shader.image("due", due)
                shader.image("due_counts", counts)
                shader.uniform_int("result", (first * len(SAMPLES),))
            gpu.compute.dispatch(shader, blocks, len(SAMPLES), len(parts))
        return due

    def _add_up(self) -> None:
        """The total of all parts."""
        total = self._total.reserve(self.count)
        if not self._parts:
            fill_elements(total, 0, self.count, 0.0, "RGBA32F")
        add_patches(total, self.count, [light.values.texture for light in self._parts.values()])

    def find_spread(self, part: Part, places: Places, first: int, stop: int, spread) -> None:
        """Mean and standard deviation of the luminance at the points of patches ``first`` .. ``stop`` if nothing stands
        between, into ``spread`` (RG32F)."""
        lanes = 1 if is_software() else _POINTS_SIDE_BY_SIDE
        shader = program("patch_spread_comp", POINTS=places.each, LANES=lanes, **self._defines(part))
        self._bind(shader, part, places)
        shader.image("spread", spread)
        for name, value in (
            ("first_patch", first),
            ("patch_count", stop - first),
            ("point_count", spread_points(part, self._scene.lamp_count)),
            ("seed", self._settings.seed),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, (stop - first) * lanes)

    # Samples
    # ------------------------------------------------------------------------------------------------------------------

    def light(
        self,
        places: Places,
        chosen,
        lists: list[_List],
        target,
        first_key: int = 0,
        part: Part = ALL,
    ) -> Steps[None]:
        """Direct light by ``part`` of the patches or texels in ``lists`` of ``chosen``, at their ``places``, into
        ``target``; in steps."""
        work = sum(count * samples for _first, count, samples in lists)
        for begins, portion in enumerate(self._portions(part)):
            rays = -(-(portion[1] - portion[0]) // self._lamps_a_ray) if isinstance(portion, tuple) else 1
            samples_each = max(1, _SAMPLES_EACH // rays) if is_software() else 1

            def light(start: int, number: int, portion=portion, samples_each=samples_each, begins=begins == 0) -> None:
                some = _cut(lists, start, start + number)
                self._light_portion(portion, places, chosen, some, samples_each, target, first_key, begins)

            yield from self._pace.portions("direct", work, light, 4096, _SAMPLES_AT_ONCE)

    def _portions(self, part: Part) -> list[Part]:
        """``part`` in portions small enough for one thread, see patch_direct_comp.glsl."""
        if part == EMITTERS:
            return [EMITTERS]
        first, stop = part if isinstance(part, tuple) else (0, self._scene.lamp_count)
        at_once = max(_LAMPS_AT_ONCE // self._lamps_a_ray, 1) * self._lamps_a_ray
        portions: list[Part] = [(at, min(at + at_once, stop)) for at in range(first, stop, at_once)]
        return [*portions, EMITTERS] if part == ALL and self._scene.emitter_count else portions

    def _light_portion(
        self,
        part: Part,
        places: Places,
        chosen,
        lists: list[_List],
        samples_each: int,
        target,
        first_key: int,
        begins: bool,
    ) -> None:
        entries = sum(count for _first, count, _samples in lists)
        if not entries:
            return
        threads = sum(count * -(-samples // samples_each) for _first, count, samples in lists)
        sums = self.scratch("sums", threads, "samples")
        defines = self._defines(part) | places.defines
        shader = program("patch_direct_comp", POINTS=places.each, **defines)
        self._bind(shader, part, places)
        places.bind_couplings(shader)
        shader.image("sums", sums)
        shader.uniform_int("first_key", (first_key,))
        shader.uniform_int("seed", (self._settings.seed,))
        _bind_lists(shader, chosen, lists, samples_each)
        dispatch_linear(shader, threads)
        shader = program("patch_mean_comp")
        shader.uniform_sampler("sums", sums)
        shader.image("direct", target)
        shader.uniform_int("begins", (int(begins),))
        _bind_lists(shader, chosen, lists, samples_each)
        dispatch_linear(shader, entries)

    def _defines(self, part: Part) -> dict:
        defines = self._scene.light_defines if part == EMITTERS else self._scene.ray_defines
        return defines | self._scene.sheet_defines

    def _bind(self, shader, part: Part, places: Places) -> None:
        if part == EMITTERS:
            self._scene.bind_light_of_emitters(shader)
            self._scene.bind(shader, "lights")  # declared though not read
        else:
            self._scene.bind_lamps(shader)
            first, stop = part if isinstance(part, tuple) else (0, 0)
            for name, value in (("first_light", first), ("light_count", stop), ("lamps_a_ray", self._lamps_a_ray)):
                shader.uniform_int(name, (value,))
        shader.uniform_sampler("patch_points", places.points)
        self._scene.bind_sheets(shader, places.sheets)


def reduce_patches(values, first: int, stop: int, results, result: int, others=None) -> None:
    """The sum of the first channel of elements ``first`` .. ``stop`` of ``values``, or with ``others`` the largest
    colour of both added, into element ``result`` of ``results`` (R32F)."""
    shader = program("patch_reduce_comp", LARGEST=others is not None)
    shader.uniform_sampler("values", values)
    if others is not None:
        shader.uniform_sampler("others", others)
    shader.image("results", results)
    for name, value in (("first", first), ("stop", stop), ("result", result)):
        shader.uniform_int(name, (value,))
    gpu.compute.dispatch(shader, 1, 1, 1)


def add_patches(total: gpu.types.GPUTexture, count: int, terms) -> None:
    """Makes ``total`` the sum of the arrays ``terms`` of ``count`` patches, in their order."""
    for first in range(0, len(terms), _MOST_TERMS):
        some = terms[first : first + _MOST_TERMS]
        shader = program("patch_add_comp", TERMS=len(some))
        for number, term in enumerate(some):
            shader.uniform_sampler(f"term{number}", term)
        shader.image("total", total)
        shader.uniform_int("patch_count", (count,))
        shader.uniform_int("begins", (int(first == 0),))
        dispatch_linear(shader, count)


def _cut(lists: list[_List], start: int, stop: int) -> list[_List]:
    """Of ``lists``, one after the other, the entries whose first sample is one of ``start`` .. ``stop``."""
    cut, base = [], 0
    for first, count, samples in lists:
        low, high = (min(max(-((base - bound) // samples), 0), count) for bound in (start, stop))
        cut.append((first + low, high - low, samples))
        base += count * samples
    return cut


def _bind_lists(shader, chosen, lists: list[_List], samples_each: int) -> None:
    """``lists`` of ``chosen`` as patch_lists_lib.glsl reads them; ``samples_each``: that a thread takes."""
    padded = [*lists, *[(0, 0, 1)] * (_MOST_LISTS - len(lists))]
    shader.uniform_sampler("patches", chosen)
    shader.uniform_int("samples_each", (samples_each,))
    for name, values in zip(("list_first", "list_count", "list_samples"), zip(*padded)):
        shader.uniform_int(name, values)
