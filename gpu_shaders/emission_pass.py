# SPDX-License-Identifier: GPL-3.0-or-later
"""What probes see of sampled emitters, by their texels and by points on the emitters."""

from __future__ import annotations

import gpu

from ..core.emitters import PROBE_POINTS, PROBE_RAYS
from ..core.settings import BakeSettings
from .dispatch import is_software
from .gradient_pass import GradientPass
from .programs import program
from .scene_textures import SceneTextures

_SUMS_BYTES = 40 << 10  # that a group may share for its sums: any GPU has 48 KiB, and lists take some
_Layers = tuple[gpu.types.GPUTexture, int]
_Where = tuple[gpu.types.GPUTexture, int, dict, _Layers]


def project_emitters(
    scene: SceneTextures,
    settings: BakeSettings,
    where: _Where,
    texel_weights: gpu.types.GPUTexture,
    gradient: GradientPass,
    emitted: gpu.types.GPUTexture,
) -> None:
    """Writes it to ``emitted`` and its change to ``gradient.emitted``. ``where``: slots of probes, the one of layer 0,
    the images of texel surfaces, a list of their layers and its length."""
    probe_slots, first_slot, textures, (listed, count) = where
    shader = program(
        "emission_project_comp",
        FACE=settings.face,
        BANDS=settings.bands,
        COEFFICIENTS=settings.bands**2,
        GROUP=_threads_a_probe(settings.bands**2),
        GRADIENT_COEFFICIENTS=gradient.coefficients,
        CANDIDATE_COUNT=PROBE_POINTS,
        RAYS=PROBE_RAYS,
        **scene.light_defines,
    )
    scene.bind_surfaces(shader)
    scene.bind_emitters(shader)
    shader.uniform_sampler("probe_slots", probe_slots)
    shader.uniform_sampler("probe_layers", listed)
    shader.uniform_sampler("texel_weights", texel_weights)
    for name in ("geometry", "emission"):
        shader.uniform_sampler(name, textures[name])
    shader.image("emitted", emitted)
    shader.image("emitted_gradient", gradient.emitted)
    shader.uniform_float("nearest", gradient.nearest)
    shader.uniform_int("first_slot", (first_slot,))
    shader.uniform_int("seed", (settings.seed,))
    gpu.compute.dispatch(shader, count, 1, 1)


def _threads_a_probe(coefficients: int) -> int:
    """That share its candidates: on a GPU as many as can put their sums side by side, see group_sum_lib.glsl."""
    if is_software():
        return 64
    return 256 if 16 * 256 * coefficients <= _SUMS_BYTES else 128
