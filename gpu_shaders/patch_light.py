# SPDX-License-Identifier: GPL-3.0-or-later
"""Light between patches on the GPU: direct light, rays between patches, bounces.

patch_finder.py knows which patch is where; here its points are lit and its rays traced. Everything that depends on
geometry alone (points, ends of rays, what they reflect) stays where it is when only lights change.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import gpu
import numpy as np

from ..core.extrapolation import STATES, Sums, reduced_rank
from ..core.grid import Grid
from ..core.patches import MOST_ROUNDS, RAYS, Part, effort, gather_rays
from ..core.settings import BakeSettings
from ..core.steps import Pace, Steps, run
from .dispatch import dispatch_linear
from .elements import copy_elements
from .growing_array import GrowingArray
from .highlight_pass import EndedRays, find_highlights
from .patch_direct import PatchDirect, add_patches, reduce_patches
from .patch_finder import PatchFinder
from .places import Places, find_couplings
from .programs import program
from .scene_textures import SceneTextures
from .textures import allocate, numbers, read, scratch, upload

_RAYS_AT_ONCE = 1 << 20
_CHANGE_GROUPS = 32  # that compare iterations
_UNSEEN = 1e-6  # weight of patches that no probe sees where iterations are compared: light may still be on its way


@dataclass(frozen=True)
class Rays:
    """Rays to trace: ``each`` of every one of ``count`` patches or texels of ``places`` from number ``first`` on.

    What they ``reflected`` (an element a ray) and what light they ``brought`` (an element a patch or texel) is written
    to arrays that begin with number 0 of ``places``. Rays of more than one segment go on as paths, and are lit where
    they bounce. ``first_key``: what ``places`` number 0 is among all, for its random numbers."""

    places: Places
    first: int
    count: int
    each: int
    reflected: gpu.types.GPUTexture
    brought: gpu.types.GPUTexture
    segments: int = 1
    first_key: int = 0

    @property
    def total(self) -> int:
        return self.count * self.each


@dataclass(frozen=True)
class _Receivers:
    """``count`` patches or texels that light reaches: without a bounce (``direct``: irradiance), with their rays
    (``brought``), and from the patches on which those end (``ends``, of which ``reflected`` comes back).

    Linear arrays of an element each, the last two of ``rays_each`` times as many."""

    count: int
    direct: gpu.types.GPUTexture
    brought: gpu.types.GPUTexture
    ends: gpu.types.GPUTexture
    reflected: gpu.types.GPUTexture
    rays_each: int


class PatchLight:
    """Patches of one bake with their light."""

    def __init__(self, scene: SceneTextures, grid: Grid, settings: BakeSettings, world_texels, pace: Pace):
        """``world_texels``: the world's radiance as a linear texture, faces of ``settings.face``²; may be replaced."""
        self.patches = PatchFinder(scene, grid)
        self._scene, self._settings = scene, settings
        self.world_texels = world_texels
        self._direct = PatchDirect(scene, settings, pace)
        self._change = scratch(3 * _CHANGE_GROUPS * STATES, "sums")  # of the iterations that nobody was told of yet
        self._untold = 0
        self._highlighted: gpu.types.GPUTexture | None = None  # what rays bring, highlights with it, where it is known
        self._brightest: gpu.types.GPUTexture | None = None  # of the light that bounces begin with, where it is known

    @property
    def count(self) -> int:
        return self.patches.count

    def release_scratch(self) -> None:
        """Lets go of what only changes of light need."""
        self._direct.scratch.release()

    # Light
    # ------------------------------------------------------------------------------------------------------------------

    def light_new_patches(self) -> Steps[None]:
        """Direct light of the patches that were bound since the last call, in steps."""
        if self._direct.count == self.count:
            return
        if self._direct.count == 0:
            self._direct.effort = effort(self.count, self._settings.samples, self._settings.face)
        yield from self._direct.add(self.patches.places, self.count)
        self._brightest = self._highlighted = None

    def light_again(self, changed: np.ndarray, emitters: bool) -> Steps[int]:
        """Direct light of all patches where lamps ``changed`` (lamp_count,) bool, or sampled ``emitters`` did, in
        steps. Returns the number of lamps that were computed."""
        lamps = yield from self._direct.again(self.patches.places, changed, emitters)
        self._brightest = self._highlighted = None
        return lamps

    @property
    def direct(self) -> gpu.types.GPUTexture:
        """Irradiance by lamps and sampled emitters, an element a patch."""
        return self._direct.texture

    def direct_by_part(self) -> list[tuple[Part, gpu.types.GPUTexture, gpu.types.GPUTexture]]:
        """The same by each part of the light, and how unevenly that would fall if nothing stood between."""
        return self._direct.by_part()

    # Rays
    # ------------------------------------------------------------------------------------------------------------------

    def connect(self) -> Steps[None]:
        """Traces the rays between patches, round by round until they find no surface that is no patch yet, and makes
        room for the bounces; in steps. Where light is not to bounce nobody asks where rays end: each patch has one then
        and none looks for surface."""
        is_direct = self._settings.bounces == 0 and not self._settings.gather
        self._rays_each = 1 if is_direct else RAYS * self._direct.effort
        self._ends, self._reflected = GrowingArray("rays", "R32F"), GrowingArray("rays")
        self._brought = GrowingArray("patches")
        self._ends.reserve(0)
        stop = 0
        for round_ in range(MOST_ROUNDS - 1 if is_direct else 0, MOST_ROUNDS):
            start, stop = stop, self.count
            for rays, hits in self._trace_patches(start, stop):
                found = self.patches.bind_ends(hits, rays.total, round_)
                ends = self._ends.reserve(stop * rays.each)
                copy_elements(found, ends, "R32F", rays.total, rays.first * rays.each)
                yield
            if stop == self.count:
                break
        yield from self.light_new_patches()
        if not is_direct:
            self._let_go_of_caught()
        self._irradiance = [allocate(self.count, "patches") for _ in range(STATES)]
        yield

    def _let_go_of_caught(self) -> None:
        """Light that a handful of patches would keep among themselves for ever gets lost."""
        shader = program("patch_caught_comp")
        shader.image("ray_ends", self._ends.texture)
        shader.uniform_int("patch_count", (self.count,))
        shader.uniform_int("rays_each", (self._rays_each,))
        dispatch_linear(shader, self.count)

    def carry_again(self) -> Steps[bool]:
        """What rays bring along and reflect, for another world or other materials, in steps; where they end stays.

        False if a ray that reflected nothing now does, or the other way round: then patches must be found anew.
        """
        before = self._reflecting()
        for _ in self._trace_patches(0, self.count):
            yield
        self._brightest = self._highlighted = None
        return not (self._reflecting() != before).any()

    def _reflecting(self) -> np.ndarray:
        """(rays,) bool: does light come back?"""
        return read(self._reflected.texture, self.count * self._rays_each)[:, :3].any(axis=1)

    def _trace_patches(self, start: int, stop: int) -> Iterator[tuple[Rays, Places]]:
        """The rays of patches ``start`` .. ``stop``, part by part, and where they end."""
        at_once = max(1, _RAYS_AT_ONCE // self._rays_each)
        reflected, brought = self._reflected.reserve(stop * self._rays_each), self._brought.reserve(stop)
        for first in range(start, stop, at_once):
            count = min(stop - first, at_once)
            rays = Rays(self.patches.places, first, count, self._rays_each, reflected, brought)
            yield rays, self._trace(rays)

    def _trace(self, rays: Rays) -> Places:
        """Where ``rays`` end, an element each, see patch_rays_comp.glsl."""
        hits, carried = (scratch(rays.total, "rays") for _ in range(2))
        sheets = scratch(rays.total, "rays", "R32F") if self._scene.has_sheets else None
        shader = self._bind_ray_scene(rays)
        shader.uniform_sampler("patch_points", rays.places.points)
        shader.uniform_sampler("world_texels", self.world_texels)
        for name, texture in (("hits", hits), ("carried", carried), ("reflected", rays.reflected)):
            shader.image(name, texture)
        if sheets is not None:
            shader.image("hit_sheets", sheets)
        for name, value in (
            ("first_ray", rays.first * rays.each),
            ("ray_count", rays.total),
            ("rays_each", rays.each),
            ("first_key", rays.first_key),
            ("seed", self._settings.seed),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, rays.total)
        shader = program("patch_carried_comp")
        shader.uniform_sampler("carried", carried)
        shader.image("brought", rays.brought)
        for name, value in (("first_patch", rays.first), ("patch_count", rays.count), ("rays_each", rays.each)):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, rays.count)
        return Places(hits, 1, sheets)

    def _bind_ray_scene(self, rays: Rays):
        """The shader that traces ``rays``, with what it reads of the scene bound: lamps only where rays are lit."""
        scene, is_path = self._scene, rays.segments > 1
        defines = scene.path_defines if is_path or scene.has_gloss else scene.surface_defines | scene.sheet_defines
        defines = defines | rays.places.defines
        shader = program(
            "patch_rays_comp", FACE=self._settings.face, POINTS=rays.places.each, SEGMENTS=rays.segments, **defines
        )
        scene.bind_surfaces(shader)
        if is_path:
            scene.bind_lights(shader)
        elif scene.has_gloss:
            scene.bind_mirrored_lights(shader)
        scene.bind_gloss(shader)
        scene.bind_sheets(shader, rays.places.sheets)
        rays.places.bind_couplings(shader)
        return shader

    # Bounces
    # ------------------------------------------------------------------------------------------------------------------

    @property
    def irradiance(self) -> gpu.types.GPUTexture:
        """Newest irradiance, an element a patch."""
        return self._irradiance[0]

    def iterate(self, bounce: bool) -> None:
        """The first irradiance, of direct light, or one bounce more. ``differences`` tells how they differ; STATES
        iterations may go before it is asked."""
        self._irradiance.insert(0, self._irradiance.pop())
        ends, reflected = self._ends.texture, self._reflected.texture
        brought = self._all_brought() if bounce else self._brought.texture  # of which nothing is asked without a bounce
        patches = _Receivers(self.count, self.direct, brought, ends, reflected, self._rays_each)
        self._bounce(patches, self._irradiance[1], self._irradiance[0], bounce)
        self._compare(*self._irradiance[:3])

    def _all_brought(self) -> gpu.types.GPUTexture:
        """What rays bring along, and of highlights where they end."""
        if not self._scene.has_faint_gloss:
            return self._brought.texture
        if self._highlighted is None:
            places = self.patches.places
            rays = EndedRays(places, self.count, self._rays_each, self._ends.texture, self._reflected.texture)
            self._highlighted = self._with_highlights(rays, self._brought.texture)
        return self._highlighted

    def _with_highlights(self, rays: EndedRays, brought: gpu.types.GPUTexture) -> gpu.types.GPUTexture:
        found, total = (scratch(rays.count, "patches") for _ in range(2))
        find_highlights(self._scene, self._settings.seed, rays, self.patches.places, self.direct_by_part(), found)
        add_patches(total, rays.count, [brought, found])
        return total

    def _compare(self, new, old, older) -> None:
        if self._brightest is None:
            self._brightest = scratch(1, "patches", "R32F")
            reduce_patches(self.direct, 0, self.count, self._brightest, 0, others=self._brought.texture)
        shader = program("patch_change_comp")
        for name, texture in (("irradiance_new", new), ("irradiance_old", old), ("irradiance_older", older)):
            shader.uniform_sampler(name, texture)
        shader.uniform_sampler("patch_seen", self.patches.seen)
        shader.uniform_sampler("brightest", self._brightest)
        shader.uniform_float("unseen", _UNSEEN)
        shader.uniform_float("tolerance", self._settings.tolerance)
        shader.image("change", self._change)
        shader.uniform_int("patch_count", (self.count,))
        shader.uniform_int("result", (3 * _CHANGE_GROUPS * self._untold,))
        gpu.compute.dispatch(shader, _CHANGE_GROUPS, 1, 1)
        self._untold += 1

    def differences(self) -> list[tuple[Sums, float]]:
        """Of each iteration since this was asked last: sums over patches in probes' sight, all to one scale; of their
        luminance to none. Waits for the GPU."""
        rows = read(self._change, 3 * _CHANGE_GROUPS * self._untold).reshape(-1, _CHANGE_GROUPS, 3, 4)
        self._untold = 0
        told = []
        for groups in rows.astype(float):
            (energy, change, overlap, luminance), (patches, slow, *others) = groups[:, :2].sum(axis=0).tolist()
            told.append(
                (Sums(energy, change, overlap, slow / max(patches, 1e-30), *others), luminance / groups[0, 2, 0])
            )
        return told

    def _bounce(self, receivers: _Receivers, source, target, bounce: bool = True) -> None:
        """Irradiance of ``receivers`` into ``target``: what reaches them without a bounce, and with ``bounce`` what
        patches of irradiance ``source`` send."""
        shader = program("patch_iterate_comp")
        for name, texture in (
            ("direct", receivers.direct),
            ("brought", receivers.brought),
            ("reflected", receivers.reflected),
            ("ray_ends", receivers.ends),
            ("irradiance_in", source),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("irradiance_out", target)
        for name, value in (
            ("patch_count", receivers.count),
            ("rays_each", receivers.rays_each),
            ("bounce", int(bounce)),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, receivers.count)

    def extrapolate(self, factor: float) -> None:
        """irradiance += factor · (irradiance − irradiance of the iteration before)."""
        shader = program("patch_extrapolate_comp")
        shader.uniform_sampler("irradiance_old", self._irradiance[1])
        shader.image("irradiance", self._irradiance[0])
        shader.uniform_int("patch_count", (self.count,))
        shader.uniform_float("factor", factor)
        dispatch_linear(shader, self.count)

    def extrapolate_modes(self) -> None:
        """Goes to the limit that the last states tell of, where they do: all slow modes at once."""
        states = np.stack([read(texture, self.count)[:, :3] for texture in self._irradiance])
        limit = reduced_rank(states)  # patches that no probe sees count as well: what they send is on its way
        if limit is not None:
            rows = np.zeros((self.count, 4), np.float32)
            rows[:, :3] = limit
            self._irradiance[0] = upload(rows, "patches")

    def slow_shares(self, albedo: gpu.types.GPUTexture, face: int, layers: np.ndarray) -> np.ndarray:
        """(L,) for probes in ``layers`` (L,) of texel surfaces with ``albedo``: of their texels that see patches, the
        share that sees slow ones. After the last iteration."""
        shares = scratch(len(layers), "probes", "R32F")
        shader, listed = program("probe_hollow_comp", FACE=face), numbers(layers, "probes")
        shader.uniform_sampler("probe_layers", listed)
        for name, texture in zip(("irradiance_new", "irradiance_old", "irradiance_older"), self._irradiance):
            shader.uniform_sampler(name, texture)
        shader.uniform_sampler("albedo", albedo)
        shader.uniform_float("tolerance", self._settings.tolerance)
        shader.image("shares", shares)
        gpu.compute.dispatch(shader, len(layers), 1, 1)
        return read(shares, len(layers), channels=1)[:, 0]

    # Final gather
    # ------------------------------------------------------------------------------------------------------------------

    def gather(self, texels: Places, count: int, first_key: int) -> gpu.types.GPUTexture:
        """Irradiance of ``count`` ``texels`` by light and paths of their own instead of their patches'; ``first_key``:
        the number of the first texel among all."""
        settings = self._settings
        rays_each = gather_rays(settings.samples)
        direct, result = allocate(count, "texels"), allocate(count, "texels")
        if self._scene.has_faint_gloss:
            couplings = allocate(2 * count, "texels")
            find_couplings(self._scene, texels.points, texels.each, 0, count, couplings)
            texels = replace(texels, couplings=couplings)
        reflects = np.flatnonzero(read(texels.points, count)[:, 3] >= 0)
        chosen = numbers(reflects, "texels")
        run(self._direct.light(texels, chosen, [(0, len(reflects), settings.samples)], direct, first_key))
        reflected, brought = scratch(count * rays_each, "rays"), scratch(count, "texels")
        rays = Rays(texels, 0, count, rays_each, reflected, brought, settings.gather, first_key)
        ends = self.patches.bind_ends(self._trace(rays), rays.total, MOST_ROUNDS - 1)
        if self._scene.has_faint_gloss and settings.gather == 1:  # of longer paths nobody knows how they ended
            brought = self._with_highlights(EndedRays(texels, count, rays_each, ends, reflected, first_key), brought)
        self._bounce(_Receivers(count, direct, brought, ends, reflected, rays_each), self._irradiance[0], result)
        return result
