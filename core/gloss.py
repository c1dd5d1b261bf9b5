# SPDX-License-Identifier: GPL-3.0-or-later
"""Gloss: the part of what a surface sends back that goes where a mirror would send it, or near there.

A material sends back its albedo A in all. Of that, S is mirrored by microfacets (A · share, or where a coat lies over a
pattern the same everywhere), the rest D = A − S leaves in all directions. Facets are GGX of width α = roughness²; what
one reflects grows towards grazing angles, scaled so that the mean over all directions stays S. What is not mirrored
goes on to the diffuse part, so no light is lost or made:

    F = S · (f + (1 − f)·s(θ)) / (f + (1 − f)·g)                   θ: between view and facet, f: reflectance at θ = 0
    D' = D · (1 − F) / (1 − S)

where g is the mean of s. For metals s is (1 − cos θ)⁵ (Schlick), for dielectrics what Fresnel's formula makes of it
with an index of 1.5: at 60° Schlick's facets mirror a fifth less than plastic does. Dielectric is what reflects less
than DIELECTRIC of what it meets face on.

Directions are drawn from the facets that the view sees (Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical
Caps", HPG 2023) and kept with the chance that the way out is open, G₂/G₁ (Heitz, "Understanding the Masking-Shadowing
Function", JCGT 2014). So they have the shape of what leaves after one reflection and all of its energy, as Cycles'
closures that preserve energy do.

Lamps and sampled emitters are met by mirrored rays where they are large against the lobe, by points on them where they
are small: each by its ``share_of_points``. For points the lobe is at least as wide as a blur, so that a mirror's image
of a lamp that nothing would find by chance is a soft one (path space regularisation: Kaplanyan and Dachsbacher, CGF
2013).

Readable twin of gpu_shaders/glsl/gloss_lib.glsl. N places; vectors are unit length, views point to where light goes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .sampling import pcg3d, tangent_frame

MOST_REFLECTIONS = 8  # of a ray in a row; what the last one meets reflects in all directions
TEXEL_RAYS = 4  # of a texel on a glossy surface
TEXEL_LOOKS, LEAST_LOOKS = 64, 4  # at lamps, of the same, and
LOOKS_IN_ALL = 1024  # at each of them together where there are many
LOOKS_A_RAY = 8  # share the rays of one of them
PATCH_BLUR = 0.2  # least width α of lobes in which patches see lamps
# And probes: against how far facets that mirror one way turn from one side of a texel to the other, radians.
TEXEL_BLUR = 0.4
DIELECTRIC = 0.2  # of light: what facets of dielectrics reflect at most that are seen face on
ATTEMPTS = 4  # to find a facet whose way out is open
REFLECTION_STREAM = 0x4CF5AD43
LIGHT_STREAM = 0x27D4EB2F
_LEAST_COSINE = 1e-4
_UNIT = 1.0 / 16777216.0


@dataclass(frozen=True)
class Gloss:
    """``share`` of what is sent back that is mirrored, or of the light itself where that is ``fixed``, whatever is sent
    back; ``facing`` (f above), per channel; ``roughness`` as Blender has it."""

    share: tuple[float, float, float]
    facing: tuple[float, float, float]
    roughness: float
    fixed: bool = False


NO_GLOSS = Gloss((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.0)


def gloss_rows(glosses: Sequence[Gloss | None]) -> np.ndarray:
    """(M, 2, 4) float32 elements of gloss_lib's ``gloss_rows``: share, α | facing, fixed."""
    rows = np.zeros((max(len(glosses), 1), 2, 4), np.float32)
    for row, gloss in zip(rows, glosses):
        gloss = gloss or NO_GLOSS
        row[0] = (*gloss.share, gloss.roughness**2)
        row[1] = (*gloss.facing, gloss.fixed)
    return rows


@dataclass
class Reflections:
    """What glossy places do with light that goes to their views by one facet each."""

    direction: np.ndarray  # (N, 3) where mirrored light comes from
    mirrored: np.ndarray  # (N, 3) F above
    diffuse: np.ndarray  # (N, 3) D' above


@dataclass
class GlossyPlaces:
    """Places on glossy surfaces and the ``view`` (N, 3) that they are seen from."""

    rows: np.ndarray  # (N, 2, 4) of gloss_rows
    albedo: np.ndarray  # (N, 3)
    normal: np.ndarray  # (N, 3) shading normal on the view's side
    geometric: np.ndarray  # (N, 3) of the triangle, on the view's side
    view: np.ndarray  # (N, 3)

    @property
    def alpha(self) -> np.ndarray:
        return self.rows[:, 0, 3]

    def at(self, chosen: np.ndarray) -> GlossyPlaces:
        return GlossyPlaces(*(value[chosen] for value in vars(self).values()))

    def mirrored(self, cosine: np.ndarray) -> np.ndarray:
        """(N, 3) what facets reflect that are seen at ``cosine`` (N,)."""
        facing = self.rows[:, 1, :3]
        dielectric = facing.max(axis=1) < DIELECTRIC
        grazing = np.where(dielectric, dielectric_growth(cosine), np.clip(1 - cosine, 0, 1) ** 5)[:, None]
        mean = mean_growth(self.alpha, dielectric)[:, None]
        shape = (facing + (1 - facing) * grazing) / (facing + (1 - facing) * mean)
        return np.minimum(self._whole() * shape, 1.0)

    def _whole(self) -> np.ndarray:
        """(N, 3) S above."""
        share = self.rows[:, 0, :3]
        return np.where(self.rows[:, 1, 3:] > 0, np.minimum(share, self.albedo), self.albedo * share)

    def reflect(self, events: np.ndarray, first: np.ndarray) -> Reflections:
        """One facet each; ``events`` (N, 3) are random keys, ``first`` (N, 2) numbers of the first attempt."""
        tangent, bitangent = tangent_frame(self.normal)
        local = np.stack(
            [
                np.einsum("ni,ni->n", self.view, tangent),
                np.einsum("ni,ni->n", self.view, bitangent),
                np.maximum(np.einsum("ni,ni->n", self.view, self.normal), _LEAST_COSINE),
            ],
            axis=1,
        )
        local /= np.linalg.norm(local, axis=1, keepdims=True)
        open_, cosine = np.zeros(len(local), bool), np.zeros(len(local))
        out = np.zeros_like(local)
        for attempt in range(ATTEMPTS):
            numbers = unit_numbers(pcg3d(events + np.array([attempt + 1, 0, 0], np.uint32)))
            facet = visible_facets(local, self.alpha, first if attempt == 0 else numbers[:, :2])
            along = np.einsum("ni,ni->n", local, facet)
            way = 2 * along[:, None] * facet - local
            out[~open_], cosine[~open_] = way[~open_], along[~open_]
            open_ |= (way[:, 2] > 0) & (numbers[:, 2] < _open_share(local, way, self.alpha))
        out[:, 2] = np.abs(out[:, 2])
        direction = out[:, :1] * tangent + out[:, 1:2] * bitangent + out[:, 2:] * self.normal
        beneath = np.minimum(np.einsum("ni,ni->n", direction, self.geometric), 0.0)
        direction -= 2 * beneath[:, None] * self.geometric
        mirrored = self.mirrored(cosine)
        return Reflections(direction / np.linalg.norm(direction, axis=1, keepdims=True), mirrored, self._rest(mirrored))

    def _rest(self, mirrored: np.ndarray) -> np.ndarray:
        whole = self._whole()
        share = np.where(whole < 0.999, (1 - mirrored) / np.maximum(1 - whole, 1e-3), 1.0)
        return (self.albedo - whole) * share

    def lobe(self, towards: np.ndarray, alpha: np.ndarray) -> np.ndarray:
        """(N, 3) radiance sent to the view per unit of radiance and solid angle from ``towards`` (N, 3), cosine
        included, by lobes of the width ``alpha`` (N,)."""
        out = np.maximum(np.einsum("ni,ni->n", self.view, self.normal), _LEAST_COSINE)
        arriving = np.einsum("ni,ni->n", towards, self.normal)
        half = self.view + towards
        half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-20)
        squared = alpha * alpha
        height = np.einsum("ni,ni->n", half, self.normal)
        spread = squared / (np.pi * ((squared - 1) * height * height + 1) ** 2)
        masking = 1 / (1 + _hidden(out, alpha) + _hidden(np.maximum(arriving, _LEAST_COSINE), alpha))
        density = spread * masking / (4 * out) / single_albedo(alpha)
        density = np.where(arriving > 0, density, 0.0)
        return self.mirrored(np.einsum("ni,ni->n", self.view, half)) * density[:, None]


def chance_of_mirroring(reflections: Reflections) -> np.ndarray:
    """(N,) with which a ray goes on mirrored and not diffusely: by what each sends; 0 where neither sends anything."""
    mirrored, diffuse = reflections.mirrored.sum(axis=1), reflections.diffuse.sum(axis=1)
    return mirrored / np.maximum(mirrored + diffuse, 1e-30)


def visible_facets(view: np.ndarray, alpha: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(N, 3) normals of facets that ``view`` (N, 3) sees, both in the surface's frame, by ``u`` (N, 2)."""
    width = np.stack([alpha, alpha, np.ones_like(alpha)], axis=1)
    straight = view * width
    straight = straight / np.linalg.norm(straight, axis=1, keepdims=True)
    height = (1 - u[:, 1]) * (1 + straight[:, 2]) - straight[:, 2]
    sine, angle = np.sqrt(np.clip(1 - height * height, 0, 1)), 2 * np.pi * u[:, 0]
    facet = (np.stack([sine * np.cos(angle), sine * np.sin(angle), height], axis=1) + straight) * width
    return facet / np.maximum(np.linalg.norm(facet, axis=1, keepdims=True), 1e-20)


def _hidden(cosine: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """(N,) Smith's Λ: facets hidden for each that is seen."""
    squared = cosine * cosine
    return (np.sqrt(1 + alpha * alpha * np.maximum(1 - squared, 0) / squared) - 1) / 2


def _open_share(view: np.ndarray, way: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """(N,) G₂/G₁ of ``way`` (N, 3) from facets that ``view`` (N, 3) sees, in the surface's frame."""
    seen = 1 + _hidden(view[:, 2], alpha)
    return seen / (seen + _hidden(np.maximum(way[:, 2], _LEAST_COSINE), alpha))


def single_albedo(alpha: np.ndarray) -> np.ndarray:
    """(N,) share that leaves white facets after one reflection, under light from everywhere: a fit to Cycles' closures
    (scene/albedos.py) that is good to 0.04."""
    return 1 - 0.62 * alpha**1.2


def dielectric_growth(cosine: np.ndarray) -> np.ndarray:
    """(N,) s of dielectrics at ``cosine`` (N,): what facets of index 1.5 reflect of unpolarised light (Fresnel), from 0
    for those seen face on to 1 at grazing views."""
    cosine = np.clip(cosine, 0, 1)
    bent = np.sqrt(1.25 + cosine * cosine)
    across, along = (bent - cosine) / (bent + cosine), cosine * (bent + cosine)
    turned = (along - 1) / (cosine * (bent - cosine) + 1)
    return np.maximum((across * across * (1 + turned * turned) / 2 - 0.04) / 0.96, 0.0)


def mean_growth(alpha: np.ndarray, dielectric: np.ndarray) -> np.ndarray:
    """(N,) mean of s over facets seen from everywhere, of those that are ``dielectric`` (N,) bool: where they lie flat
    1/18.5, and 1/21 of metals; less where they turn to the view. Fits to what ``GlossyPlaces.reflect`` draws, good to
    a tenth."""
    return 1 / np.where(dielectric, 18.5 + 89.7 * alpha**1.22, 21 + 204 * alpha**1.55)


def blurred(alpha: np.ndarray, blur: np.ndarray) -> np.ndarray:
    """(N,) widths of lobes of ``alpha`` (N,) that are no narrower than ``blur`` (N,), nor wider than lobes are: a
    ball within a texel turns by more than that."""
    return np.minimum(np.maximum(alpha, blur), 1.0)


def looks_at(lamps: int) -> int:
    """Looks of a texel at each of so many ``lamps``."""
    return min(max(LOOKS_IN_ALL // lamps, LEAST_LOOKS), TEXEL_LOOKS) if lamps else 0


def share_of_points(extent: np.ndarray, width: np.ndarray) -> np.ndarray:
    """(N,) of the light of a lamp of ``extent`` (N,) steradians, or of an emitter of which each point stands for so
    much, that points on it answer for, where the lobe is of ``width`` α (N,); mirrored rays answer for the rest: they
    find what fills a good part of the lobe."""
    lobe = 4 * np.pi * width * width
    return lobe / (lobe + extent)


def unit_numbers(hashes: np.ndarray) -> np.ndarray:
    """(N, 3) in [0, 1)."""
    return (np.asarray(hashes, np.uint32) >> np.uint32(8)) * _UNIT


def events_of(keys: np.ndarray, numbers: np.ndarray, depth: int) -> np.ndarray:
    """(N, 3) random keys of reflection ``depth`` of the rays ``numbers`` (N,) that belong to ``keys`` (N, 3)."""
    shift = np.stack([numbers, 0 * numbers + REFLECTION_STREAM + depth, 0 * numbers], axis=1)
    return pcg3d(keys + shift.astype(np.uint32))


def light_keys_of(events: np.ndarray) -> np.ndarray:
    """(N, 3) random keys for lamps that a reflection sees."""
    return events + np.array([0, LIGHT_STREAM, 0], np.uint32)
