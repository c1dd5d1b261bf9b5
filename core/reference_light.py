# SPDX-License-Identifier: GPL-3.0-or-later
"""Light between patches, readable and slow: the twin of gpu_shaders/patch_light.py and its shaders patch_visible_comp,
patch_spread_comp, patch_direct_comp, patch_rays_comp, patch_carried_comp and patch_iterate_comp.

What a patch is, core/patches.py decides for both. Every stage can be asked by itself, with what another machine found
before it.

N patches, R rays of each; ``points`` (N, K, 4) are K places of each patch, position relative to the volume's centre and
packed normal.
"""

from __future__ import annotations

import numpy as np

from .conventions import LUMINANCE
from .cubemap import direction_to_texel
from .emitters import CANDIDATES, sampling_density
from .faint_gloss import coupled
from .gloss import MOST_REFLECTIONS, PATCH_BLUR
from .grid import Grid
from .patches import (
    ALL,
    EMITTERS,
    MOST_ROUNDS,
    NO_PATCH,
    RAYS,
    SAMPLES,
    Part,
    Patches,
    direct_samples,
    effort,
    light_parts,
    spread_points,
    without_caught,
)
from .rays import leave_surface, step_off
from .reference_emitters import ReferenceEmitters
from .reference_gloss import ReferenceGloss, TexelReflections
from .reference_highlights import EndedRays, Lit, ReferenceHighlights
from .reference_lamps import ReferenceLamps
from .reference_places import pack, split
from .reference_scene import ReferenceScene
from .reference_ways import PatchRays, Ways
from .sampling import keys_of, pcg3d, sample_cosine, sample_r2, shifted
from .settings import BakeSettings
from .sheets import off_surface, side_weight
from .snapshot import DIFFUSE_RAYS
from .world_map import world_texels
from .world_suns import extract_suns

_RAISE = 0.15  # of the distance between hit and leader: both ends of a line of sight are raised by it
_RAY_STREAM, _PATH_LIGHT_STREAM, _EMITTER_STREAM = 0x85EBCA6B, 0x1B873593, 0x2545F491
_PLACE_STREAM, _BACK_STREAM, _SIDE_STREAM = 0x85EBCA6B, 0x51ED2705, 0x6C8E9CF5
_RAY_SPREAD = 0.5  # radians: rays between patches see images blurred


class ReferenceLight:
    """All patches of one bake and their light. ``direct`` (N, 3) and ``irradiance`` (N, 3)."""

    def __init__(self, scene: ReferenceScene, grid: Grid, settings: BakeSettings):
        self.scene, self.settings = scene, settings
        self.patches = Patches(grid)
        self.emitters = ReferenceEmitters(scene, sampling_density(scene.snapshot, grid))
        # Of each part the irradiance (N, 3), and the luminance (N,) if nothing stood between.
        self.direct_by_part: dict[Part, tuple[np.ndarray, np.ndarray]] = {}
        rest, suns = extract_suns(scene.snapshot.world)
        self._lamps = ReferenceLamps(scene, suns)
        self._world = world_texels(rest, settings.face).reshape(-1, 3)
        self._effort, self._lit = 1, 0  # patches
        self.highlights = ReferenceHighlights(scene, self.emitters, self._lamps)
        self.gloss = ReferenceGloss(scene, self.emitters, self._lamps.all, self.background)

    def background(self, directions: np.ndarray) -> np.ndarray:
        """(N, 3) radiance of the world along ``directions`` (N, 3), as rays see it."""
        face, row, column = direction_to_texel(directions, self.settings.face)
        return self._world[(face * self.settings.face + row) * self.settings.face + column]

    # Which patch
    # ------------------------------------------------------------------------------------------------------------------

    def bind_texels(self, hits: np.ndarray, distance: np.ndarray, sheets: np.ndarray | None = None) -> np.ndarray:
        """(H,) patches of texels ``hits`` (H, 4) on ``sheets`` (H,) seen from ``distance`` (H,) metres."""
        return self.patches.bind(hits, distance, self._sees(hits), sheets=sheets)

    @property
    def patch_sheets(self) -> np.ndarray | None:
        """(N,) sheets that the patches are part of; None in scenes without."""
        return self.patches.sheets if self.scene.sheet.any() else None

    def _sees(self, hits: np.ndarray):
        return lambda items, patches: self.sees_leader(hits[items], self.patches.points[patches, 0])

    def sees_leader(self, hits: np.ndarray, leaders: np.ndarray) -> np.ndarray:
        """(H,) bool: does nothing stand between ``hits`` and ``leaders`` (H, 4 each), raised off their surfaces?"""
        apart = np.linalg.norm(hits[:, :3].astype(float) - leaders[:, :3], axis=1)
        ends = []
        for end in (hits, leaders):
            point, normal = split(end)
            ends.append(leave_surface(point, normal) + normal * (_RAISE * apart)[:, None])
        offset = ends[1] - ends[0]
        range_ = np.linalg.norm(offset, axis=1)
        direction = offset / np.maximum(range_, 1e-300)[:, None]
        result = np.ones(len(hits), bool)
        far = np.flatnonzero(range_ > 0)
        result[far] = self.scene.visible(ends[0][far], direction[far], range_[far])
        return result

    @property
    def direct(self) -> np.ndarray:
        """(N, 3) irradiance of patches by lamps and sampled emitters."""
        return sum((values for values, _ in self.direct_by_part.values()), np.zeros((self._lit, 3)))

    # Direct light
    # ------------------------------------------------------------------------------------------------------------------

    def light_new_patches(self) -> None:
        """Direct light of the patches that were bound since the last call."""
        lit = self._lit
        if lit == self.patches.count:
            return
        if lit == 0:
            self._effort = effort(self.patches.count, self.settings.samples, self.settings.face)
        numbers = np.arange(lit, self.patches.count)
        parts = light_parts(self._lamps.count, self.emitters.count > 0)
        sheets = self.patch_sheets
        spread = {part: self.spread(self.patches.points, numbers, part, sheets) for part in parts}
        light = sum((mean for mean, _deviation in spread.values()), np.zeros(len(numbers)))
        self._lit = self.patches.count
        for part, (mean, deviation) in spread.items():
            direct = np.zeros((len(numbers), 3))
            sample_class = direct_samples(mean, deviation, light, float(light.mean()))
            for index, samples in enumerate(SAMPLES):
                chosen = np.flatnonzero(sample_class == index)
                direct[chosen] += self.direct_light(
                    self.patches.points, numbers[chosen], samples * self._effort, part=part, sheets=sheets
                )
            values, unshadowed = self.direct_by_part.get(part, (np.zeros((lit, 3)), np.zeros(lit)))
            self.direct_by_part[part] = np.concatenate([values, direct]), np.concatenate([unshadowed, mean])

    def spread(
        self, points: np.ndarray, numbers: np.ndarray, part: Part, sheets: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (C,) of the luminance of one sample's irradiance by ``part`` at some of the
        points of the patches ``numbers`` (C,) if nothing stands between.

        Points on emitters are random themselves, but a sample's candidates average that: two at each place tell the
        two variances apart.
        """
        keys = keys_of(numbers, 0, self.settings.seed)
        count = spread_points(part, self._lamps.count)
        luminance = np.zeros((count, len(numbers)))
        candidate_variance = np.zeros(len(numbers))
        roles = self._roles(numbers, sheets)
        for index in range(count):
            point, normal = split(points[numbers, points.shape[1] // count * index])
            for side, normals, side_keys, share in self._sides(normal, keys, numbers, sheets):
                weight, role = share @ LUMINANCE, roles[side]
                if part == EMITTERS:
                    one, other = (
                        self.emitters.unshadowed(point[side], normals, side_keys, number, role) @ LUMINANCE * weight
                        for number in (2 * index, 2 * index + 1)
                    )
                    start = leave_surface(point[side], normals)
                    near = self.emitters.by_directions(start, normals, side_keys, index, role) @ LUMINANCE
                    luminance[index, side] += (one + other) / 2 + near * weight
                    candidate_variance[side] += (one - other) ** 2 / 2 / count
                else:
                    at = point[side]
                    lamps = self._lamps.unshadowed(at, normals, side_keys, index, role, part)
                    luminance[index, side] += lamps @ LUMINANCE * weight
        variance = np.maximum(luminance.var(axis=0) - candidate_variance / 2, 0.0) + candidate_variance / CANDIDATES
        return luminance.mean(axis=0), np.sqrt(variance)

    def direct_light(
        self,
        points: np.ndarray,
        numbers: np.ndarray,
        samples: int,
        first_key: int = 0,
        part: Part = ALL,
        sheets: np.ndarray | None = None,
    ) -> np.ndarray:
        """(C, 3) irradiance by ``part`` of the light: mean over ``samples`` places spread over points of the patches
        ``numbers`` (C,), on both sides where the patch is part of one of ``sheets`` (N,)."""
        keys = keys_of(first_key + numbers, 0, self.settings.seed)
        total = np.zeros((len(numbers), 3))
        each = points.shape[1]
        shift = (pcg3d(shifted(keys, 0, _PLACE_STREAM, 0))[:, 0] % each).astype(int)
        roles, coupling = self._roles(numbers, sheets), self.scene.couplings(*split(points[numbers, 0]))
        for index in range(samples):
            place = (index * each + shift) // samples if samples < each else index % each
            point, normal = split(points[numbers, place])
            for side, normals, side_keys, share in self._sides(normal, keys, numbers, sheets):
                emitter_keys = shifted(side_keys, 0, 0, _EMITTER_STREAM)
                origin = leave_surface(point[side], normals)
                total[side] += share * self._irradiance(
                    point[side], origin, normals, side_keys, emitter_keys, index, roles[side], coupling[side], part
                )
        return total / samples

    def _sides(self, normal: np.ndarray, keys: np.ndarray, numbers: np.ndarray, sheets: np.ndarray | None):
        """The sides of places with ``normal`` (C, 3) from which their patches ``numbers`` (C,) take light: which places
        have that side, their normals and random keys there, and the share (K, 3) of that side."""
        if sheets is None:
            yield slice(None), normal, keys, np.ones((len(normal), 3))
            return
        through = self.scene.sheet_shares[sheets[numbers]]
        yield slice(None), normal, keys, 1 - through
        back = np.flatnonzero(through.any(axis=1))
        yield back, -normal[back], shifted(keys[back], 0, _BACK_STREAM, 0), through[back]

    def _roles(self, numbers: np.ndarray, sheets: np.ndarray | None) -> np.ndarray:
        """(C,) roles of the patches ``numbers`` (C,) in light linking."""
        return np.zeros(len(numbers), int) if sheets is None else self.scene.sheet_roles[sheets[numbers]]

    def _irradiance(
        self, point, origin, normal, lamp_keys, emitter_keys, index, role, coupling, part: Part = ALL
    ) -> np.ndarray:
        irradiance = np.zeros_like(point)
        if part != EMITTERS:
            irradiance += self._lamps.irradiance(point, origin, normal, lamp_keys, index, role, coupling, part)
        if self.emitters.count and part in (EMITTERS, ALL):
            irradiance += self.emitters.irradiance(point, origin, normal, emitter_keys, index, role, coupling)
        return irradiance

    # Rays
    # ------------------------------------------------------------------------------------------------------------------

    def trace(
        self,
        points: np.ndarray,
        numbers: np.ndarray,
        rays_each: int,
        segments: int = 1,
        first_key: int = 0,
        sheets: np.ndarray | None = None,
    ) -> PatchRays:
        """``rays_each`` rays of each of the patches ``numbers`` (C,), with ``segments`` above 1 paths, lit where they
        bounce. Of patches on one of ``sheets`` (N,) every second ray leaves from the back."""
        patch, index = np.repeat(numbers, rays_each), np.tile(np.arange(rays_each), len(numbers))
        at = points[patch, index * points.shape[1] // rays_each % points.shape[1]]
        point, normal = split(at)
        through = self.scene.sheet_shares[np.zeros(len(patch), int) if sheets is None else sheets[patch]]
        crosses = through.any(axis=1) & (index % 2 == 1)
        normal[crosses] *= -1
        origin = leave_surface(point, normal)
        keys = keys_of(first_key + patch, _RAY_STREAM, self.settings.seed)
        hits, end_sheets = np.zeros((len(patch), 4)), np.zeros(len(patch), np.int64)
        role = self._roles(patch, sheets)
        carried, reflected = np.zeros((len(patch), 3)), side_weight(through, crosses)
        reflected[at[:, 3] < 0] = 0.0
        coupling = self.scene.couplings(*split(points[patch, 0]))
        for segment in range(segments):
            alive = np.flatnonzero(reflected.any(axis=1))
            u = sample_r2(shifted(keys[alive], 0, segment, 0), index[alive]).astype(float)
            direction = sample_cosine(normal[alive], u)
            cosine = np.einsum("ni,ni->n", normal[alive], direction)
            reflected[alive] *= coupled(coupling[alive], cosine)
            found = self.scene.closest(origin[alive], direction)
            surface = self.scene.resolve(found, direction, _RAY_SPREAD)
            missed = found.triangle < 0
            reflected[alive] *= self.scene.tint(origin[alive], direction, found.distance, DIFFUSE_RAYS)
            group, sampled = self.scene.links.group[self.scene.role[found.triangle]], self.emitters.density > 0
            share = np.where(sampled[found.triangle], 0.0, self.scene.falls_on(group, role[alive]))
            if segment > 0:
                share += self.emitters.direction_share(found, direction, cosine, role[alive])
            sent = np.where(missed[:, None], self.background(direction), surface.emission * share[:, None])
            carried[alive] += reflected[alive] * sent
            position = origin[alive] + direction * np.where(missed, 0.0, found.distance)[:, None]
            ways = Ways(direction, surface, position, reflected[alive], carried[alive])
            first = MOST_REFLECTIONS * segment
            self.gloss.follow(ways, keys[alive], index[alive], first, MOST_REFLECTIONS, PATCH_BLUR, _RAY_SPREAD)
            direction, surface, position, carried[alive] = ways.direction, ways.surface, ways.position, ways.brought
            reflected[alive] = ways.throughput * surface.albedo  # zero where a ray missed
            missed = surface.triangle < 0
            sheet = np.where(missed, 0, self.scene.sheet[surface.triangle])
            end_sheets[alive] = sheet
            role[alive] = self.scene.role[surface.triangle]
            both_sides = self.scene.sheet_shares[sheet].any(axis=1)
            hits[alive, :3] = off_surface(position, direction, np.where(missed, 0.0, surface.distance), both_sides)
            hits[alive, 3] = pack(surface.normal, ~missed)
            if segment == segments - 1:
                break
            on = reflected[alive].any(axis=1)
            alive, facing, sheet = alive[on], surface.normal[on], sheet[on]
            met = position[on], facing, direction[on], surface.distance[on]
            coupling[alive] = self.scene.couplings(position[on], facing)
            here = shifted(keys[alive], 0, _PATH_LIGHT_STREAM + segment, 0)
            arriving = self._at_bounces(*met, sheet, here, index[alive], role[alive], coupling[alive])
            carried[alive] += reflected[alive] * arriving / np.pi
            through = self.scene.sheet_shares[sheet]
            side = pcg3d(shifted(keys[alive], 0, _SIDE_STREAM + segment, 0) + _number(index[alive]))[:, 0]
            crosses = through.any(axis=1) & (side % 2 == 1)
            reflected[alive] *= side_weight(through, crosses)
            turn = np.where(crosses, -1.0, 1.0)[:, None]
            normal[alive] = turn * facing
            origin[alive] = step_off(position[on], normal[alive], -turn * direction[on], surface.distance[on])
        hits[~reflected.any(axis=1)] = (0.0, 0.0, 0.0, -1.0)
        shape = (len(numbers), rays_each)
        return PatchRays(
            hits.reshape(*shape, 4), carried.reshape(*shape, 3), reflected.reshape(*shape, 3), end_sheets.reshape(shape)
        )

    def _at_bounces(self, position, facing, direction, distance, sheet, keys, index, role, coupling) -> np.ndarray:
        """(C, 3) direct irradiance where rays have met surface, (C, …) each, from both sides of sheets. Of emitters
        what points answer for: the ray that goes on from there finds the rest."""
        arriving = np.zeros((len(position), 3))
        for side, normals, side_keys, share in self._sides(facing, keys, np.arange(len(position)), sheet):
            towards = np.where((normals * facing[side]).sum(axis=1, keepdims=True) > 0, -1, 1)
            start = step_off(position[side], normals, towards * direction[side], distance[side])
            how = position[side], start, normals, side_keys, index[side], role[side], coupling[side]
            arriving[side] += share * (self._lamps.irradiance(*how) + self.emitters.by_points(*how))
        return arriving

    def connect(self) -> None:
        """Traces rays between patches until they find no surface that is no patch yet."""
        rays_each = RAYS * self._effort
        nothing = np.zeros((0, rays_each, 4))
        parts = [PatchRays(nothing, nothing[..., :3], nothing[..., :3], np.zeros((0, rays_each), int))]
        ends, stop = [np.zeros((0, rays_each), np.int64)], 0
        for round_ in range(MOST_ROUNDS):
            start, stop = stop, self.patches.count
            if start == stop:
                break
            rays = self.trace(self.patches.points, np.arange(start, stop), rays_each, sheets=self.patch_sheets)
            parts.append(rays)
            ends.append(self._bind_ends(rays, round_).reshape(-1, rays_each))
        self.light_new_patches()
        self._ends = without_caught(np.concatenate(ends))
        self._reflected = np.concatenate([rays.reflected for rays in parts])
        self._brought = np.concatenate([rays.brought for rays in parts])
        if self.highlights.is_there:
            self._brought += self.highlights_of(EndedRays(self._ends, self._reflected))

    def highlights_of(self, rays: EndedRays, texels: Lit | None = None) -> np.ndarray:
        """(C, 3) irradiance that patches, or ``texels`` (C), get of highlights where their ``rays`` end."""
        points, sheets = self.patches.points, self.patch_sheets
        patches = points, np.zeros(len(points), int) if sheets is None else sheets
        return self.highlights.of_rays(texels or patches, patches, rays, self.direct_by_part, self.settings.seed)

    def bind_reflections(self, reflections: TexelReflections) -> np.ndarray:
        """(P·X·K,) patches on which rays of glossy texels end, founded where there are none."""
        hits, sheets = reflections.ends(self.scene)
        return self.patches.bind_ends(hits, 0, self._sees(hits), sheets)

    def _bind_ends(self, rays: PatchRays, round_: int) -> np.ndarray:
        hits = rays.hits.reshape(-1, 4).astype(np.float32)
        return self.patches.bind_ends(hits, round_, self._sees(hits), rays.sheets.ravel())

    # Bounces
    # ------------------------------------------------------------------------------------------------------------------

    def iterate(self, bounces: int) -> np.ndarray:
        """(N, 3) irradiance after ``bounces`` bounces."""
        irradiance = self.direct
        for _ in range(bounces):
            irradiance = bounce(self.direct, self._brought, self._reflected, self._ends, irradiance)
        return irradiance

    def gather(
        self,
        hits: np.ndarray,
        rays_each: int,
        irradiance: np.ndarray,
        first_key: int,
        sheets: np.ndarray | None = None,
    ) -> np.ndarray:
        """(H, 3) irradiance of texels ``hits`` (H, 4) on ``sheets`` (H,) by light and paths of their own, the last
        segment of which ends on patches of ``irradiance`` (N, 3)."""
        points, numbers = hits[:, None].astype(np.float32), np.arange(len(hits))
        direct = np.zeros((len(hits), 3))
        lit = np.flatnonzero(hits[:, 3] >= 0)
        direct[lit] = self.direct_light(points, lit, self.settings.samples, first_key, sheets=sheets)
        rays = self.trace(points, numbers, rays_each, self.settings.gather, first_key, sheets)
        ends = self._bind_ends(rays, MOST_ROUNDS - 1).reshape(len(hits), -1)
        brought = rays.brought
        if self.highlights.is_there and self.settings.gather == 1:  # of longer paths nobody knows how they ended
            texels = points, np.zeros(len(hits), int) if sheets is None else sheets
            brought = brought + self.highlights_of(EndedRays(ends, rays.reflected, first_key), texels)
        return bounce(direct, brought, rays.reflected, ends, irradiance)


def bounce(
    direct: np.ndarray, brought: np.ndarray, reflected: np.ndarray, ends: np.ndarray, irradiance: np.ndarray
) -> np.ndarray:
    """(C, 3) direct light + what rays brought along + mean over rays of albedo · ``irradiance`` (N, 3) where they end.

    Rays are cosine-weighted, so π·mean(radiance) is the irradiance and π cancels against albedo/π. Ends (C, R) that
    lie on no patch are left out of the mean, so that a furnace stays a furnace.
    """
    coming = np.where((ends >= 0)[..., None], reflected * irradiance[np.maximum(ends, 0)], 0.0)
    counted = np.maximum((ends != NO_PATCH).sum(axis=1), 1)
    return direct + brought + coming.sum(axis=1) / counted[:, None]


def _number(index: np.ndarray) -> np.ndarray:
    """(C, 3) uint32 that adds ``index`` (C,) to the first component of keys."""
    return np.stack([index, 0 * index, 0 * index], axis=1).astype(np.uint32)
