# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes a change reaches: the shader against its twin."""

from types import SimpleNamespace

import gpu
import numpy as np
import pytest
from gridlight.core import rays
from gridlight.core.change_reach import grown, probes_that_see
from gridlight.core.cubemap import texel_directions
from gridlight.core.scene_changes import boxes_around
from gridlight.gpu_shaders.backend import Surfaces
from gridlight.gpu_shaders.change_pass import probes_reached
from gridlight.gpu_shaders.textures import upload

NO_SURFACE = 1e30


def layered(values):
    """Layered image of ``values`` (P, height, width, 4)."""
    count, height, width, _ = values.shape
    flat = np.ascontiguousarray(values, np.float32).reshape(-1)
    return gpu.types.GPUTexture(
        (width, height), layers=count, format="RGBA32F", data=gpu.types.Buffer("FLOAT", flat.size, flat)
    )


@pytest.mark.parametrize("face", [4, 7])
def test_the_shader_reaches_what_the_twin_reaches(face):
    directions = texel_directions(face).reshape(-1, 3)
    agree, reached_share = [], []
    for seed in range(6):
        generator = np.random.default_rng(seed)
        triangles = generator.uniform(-1, 1, (40, 1, 3)) + generator.normal(0, 0.25, (40, 3, 3))
        positions = generator.uniform(-1, 1, (50, 3))
        many = len(directions)
        hits = rays.closest_hit(triangles, np.repeat(positions, many, axis=0), np.tile(directions, (50, 1)))
        distance = hits.distance.reshape(50, many)
        old, new = (
            grown(boxes_around(generator.uniform(-1, 1, 3) + generator.normal(0, 0.05, (6, 3, 3))), positions)
            for _ in range(2)
        )
        geometry = np.zeros((50, 6 * face, face, 4))
        geometry[..., 2] = np.minimum(distance, NO_SURFACE).reshape(50, 6 * face, face)
        geometry[..., 2] *= np.where(generator.random(geometry.shape[:3]) < 0.5, 1, -1)  # back faces
        geometry[..., 2] = np.where(np.abs(geometry[..., 2]) >= NO_SURFACE, NO_SURFACE, geometry[..., 2])
        slots = np.zeros((53, 4))
        slots[3:, :3] = positions
        backend = SimpleNamespace(face=face, probe_slots=upload(slots, "probes"))
        found = probes_reached(backend, Surfaces(3, 50, {"geometry": layered(geometry)}), old, new)
        agree.append(found == probes_that_see(positions, directions, distance, old, new))
        reached_share.append(found.mean())
    assert np.mean(agree) > 0.99  # the rest graze a box
    assert 0.1 < np.mean(reached_share) < 0.9


def test_no_box_reaches_nobody():
    none = np.empty((0, 2, 3))
    backend = SimpleNamespace(face=4, probe_slots=upload(np.zeros((2, 4)), "probes"))
    surfaces = Surfaces(0, 2, {"geometry": layered(np.full((2, 24, 4, 4), 1.0))})
    assert not probes_reached(backend, surfaces, none, none).any()
