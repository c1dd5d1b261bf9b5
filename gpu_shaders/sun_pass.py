# SPDX-License-Identifier: GPL-3.0-or-later
"""What probes see of the suns of the world, which texels are too coarse for."""

from __future__ import annotations

import gpu

from ..core.settings import BakeSettings
from ..core.world_suns import PROBE_RAYS
from .programs import program
from .scene_textures import SceneTextures


def add_suns(
    scene: SceneTextures,
    settings: BakeSettings,
    probe_slots: gpu.types.GPUTexture,
    first_slot: int,
    layers_and_count: tuple[gpu.types.GPUTexture, int],
    field: gpu.types.GPUTexture,
) -> None:
    """Adds the suns to ``field`` of the probes in the layers of ``layers_and_count``, whose slots follow
    ``first_slot``."""
    if scene.lamp_count == scene.light_count:
        return
    listed, count = layers_and_count
    bands = settings.bands
    shader = program("sun_project_comp", BANDS=bands, COEFFICIENTS=bands**2, GROUP=PROBE_RAYS, **scene.ray_defines)
    scene.bind_lamps(shader)
    shader.uniform_sampler("probe_slots", probe_slots)
    shader.uniform_sampler("probe_layers", listed)
    shader.image("field", field)
    for name, value in (("first_slot", first_slot), ("first_sun", scene.light_count), ("seed", settings.seed)):
        shader.uniform_int(name, (value,))
    gpu.compute.dispatch(shader, count, 1, 1)
