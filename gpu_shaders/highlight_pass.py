# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights of lamps in gloss that is not followed: see core/highlights.py. Scenes without such gloss have no part in
it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import gpu

from ..core.patches import EMITTERS, Part
from ..core.settings import BakeSettings
from .dispatch import dispatch_linear
from .elements import fill_elements
from .places import Places
from .programs import program
from .scene_textures import SceneTextures

# Of the light, and of each the irradiance and how unevenly it would fall if nothing stood between, an element a patch.
Parts = Iterable[tuple[Part, gpu.types.GPUTexture, gpu.types.GPUTexture]]
_Where = tuple[gpu.types.GPUTexture, int, dict, tuple[gpu.types.GPUTexture, int]]


def add_highlights(
    scene: SceneTextures,
    settings: BakeSettings,
    where: _Where,
    texel_weights: gpu.types.GPUTexture,
    parts: Parts,
    field: gpu.types.GPUTexture,
    group: int,
) -> None:
    """Adds what texels send in highlights by ``parts`` of the light of their patches to ``field``. ``where``: slots of
    probes, the one of layer 0, the images of texel surfaces, a list of their layers and its length."""
    probe_slots, first_slot, textures, (listed, count) = where
    sizes = {"BANDS": settings.bands, "COEFFICIENTS": settings.bands**2, "GROUP": group, "FACE": settings.face}
    for part, *falling in parts:
        shader = program("highlight_project_comp", **sizes, **_defines(scene, part))
        _bind(scene, shader, part, falling, settings.seed)
        scene.bind_sheets(shader)
        for name, texture in (
            ("probe_slots", probe_slots),
            ("probe_layers", listed),
            ("texel_weights", texel_weights),
            ("geometry", textures["geometry"]),
            ("albedo", textures["albedo"]),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("field", field)
        shader.uniform_int("first_slot", (first_slot,))
        gpu.compute.dispatch(shader, count, 1, 1)


@dataclass(frozen=True)
class EndedRays:
    """``each`` rays of every one of ``count`` ``places``, with numbers from ``first_key`` on: the patches ``ends`` of
    them and what part of the light there is ``reflected``."""

    places: Places
    count: int
    each: int
    ends: gpu.types.GPUTexture
    reflected: gpu.types.GPUTexture
    first_key: int = 0


def find_highlights(
    scene: SceneTextures, seed: int, rays: EndedRays, patches: Places, parts: Parts, target: gpu.types.GPUTexture
) -> None:
    """What ``rays`` bring of highlights by ``parts`` of the light of ``patches``, into ``target``, an element a place
    of the rays."""
    fill_elements(target, 0, rays.count, 0.0, "RGBA32F")
    for part, *falling in parts:
        defines = _defines(scene, part) | {"HAS_MIRRORS": scene.has_gloss}
        shader = program("patch_highlights_comp", POINTS=rays.places.each, **defines)
        _bind(scene, shader, part, falling, seed)
        scene.bind_sheets(shader, patches.sheets)
        if rays.places.sheets is not None:
            shader.uniform_sampler("leaving_sheets", rays.places.sheets)
        patches.bind_couplings(shader)
        for name, texture in (
            ("patch_points", patches.points),
            ("leaving_points", rays.places.points),
            ("reflected", rays.reflected),
            ("ray_ends", rays.ends),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("highlights", target)
        for name, value in (("first_key", rays.first_key), ("count", rays.count), ("rays_each", rays.each)):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, rays.count)


def _defines(scene: SceneTextures, part: Part) -> dict:
    defines = scene.surface_defines | scene.sheet_defines
    return defines | {"HAS_EMITTERS": part == EMITTERS, "HAS_COUPLING": True}


def _bind(scene: SceneTextures, shader, part: Part, falling: list[gpu.types.GPUTexture], seed: int) -> None:
    scene.bind_surfaces(shader)
    scene.bind(shader, "lights")
    if isinstance(part, tuple):
        for name, value in zip(("first_light", "last_light"), part):
            shader.uniform_int(name, (value,))
    else:
        scene.bind_emitters(shader)
    for name, texture in zip(("part_irradiance", "part_spread"), falling):
        shader.uniform_sampler(name, texture)
    shader.uniform_int("seed", (seed,))
