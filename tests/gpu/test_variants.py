# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaders are compiled for what a scene has. In every mixture of that they compile, and a bake agrees with paths."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.conventions import ACTIVE
from gridlight.core.emitters import sampling_density
from gridlight.core.gloss import Gloss
from gridlight.core.grid import Grid
from gridlight.core.light_links import Links
from gridlight.core.path_check import PathCheck
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import DITHERED, SHADOW_RAYS, Image, Light, Material
from gridlight.core.world_suns import extract_suns
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import bake, box, frame, snapshot_of, some_profile

GRID = Grid.from_bounds((-0.5, -0.5, -0.2), (0.5, 0.5, 0.4), (2, 2, 1))
PLAIN, SCREEN, GLOWING = range(3)  # materials
PICTURE = Image("picture", np.random.default_rng(3).uniform(0.2, 0.9, (8, 8, 4)).astype(np.float32))

# What a scene may have, by the fields of a material or of the lamp that bring it.
FEATURES = {
    "image": (PLAIN, {"base_image": 0}),
    "holes": (SCREEN, {"alpha_image": 0, "alpha_threshold": DITHERED}),
    "tint": (SCREEN, {"alpha": 0.6, "alpha_threshold": DITHERED, "tint": (0.9, 0.5, 0.3)}),
    "sheet": (SCREEN, {"transmitted": (0.4, 0.3, 0.2)}),
    "gloss": (SCREEN, {"gloss": Gloss((0.5, 0.4, 0.3), (0.6, 0.5, 0.4), 0.4)}),
    "faint gloss": (PLAIN, {"faint_gloss": Gloss((0.06,) * 3, (0.04,) * 3, 0.5, fixed=True)}),
    "unseen": (SCREEN, {"unseen_by": SHADOW_RAYS}),
    "links": (SCREEN, {"links": Links(unlit_by=1)}),
    "emitter": (GLOWING, {"emission": (30.0, 20.0, 10.0)}),
    "profile": ("lamp", {"profile": some_profile()}),
}


def mixtures():
    """None, all, and for each binary digit of a feature's number those that have it and those that have not: of any two
    features there is a mixture with both, with either and with neither."""
    names = list(FEATURES)
    yield "all", names
    yield "none", []
    for digit in range(len(names).bit_length()):
        for value in (0, 1):
            yield f"{digit}={value}", [name for number, name in enumerate(names) if number >> digit & 1 == value]


def room(names):
    """A room with a screen, a lamp, and a small box that glows where the features ``names`` say so."""
    screen = np.array([(-0.6, -0.6, -0.5), (0.7, -0.5, -0.45), (0.6, 0.7, -0.5), (-0.5, 0.6, -0.4)])
    corners = np.concatenate(
        [box()[:, ::-1], screen[[[0, 1, 2], [0, 2, 3]]], box((0.55, 0.5, -0.9), (0.65, 0.6, -0.8))]
    )
    material = np.repeat([PLAIN, SCREEN, GLOWING], [12, 2, 12])
    materials = [
        Material("plain", (0.6, 0.5, 0.4)),
        Material("screen", (0.5, 0.5, 0.6)),
        Material("glowing", (0.2, 0.2, 0.2)),
    ]
    lamp = Light("lamp", "POINT", (2.0, 1.5, 1.0), frame((0.1, 0.2, 0.8)), radius=0.1, link_group=int("links" in names))
    for target, fields in (FEATURES[name] for name in names):
        if target == "lamp":
            lamp = replace(lamp, **fields)
        else:
            materials[target] = replace(materials[target], **fields)
    uvs = np.random.default_rng(1).uniform(0, 1, (len(corners), 3, 2))
    images = [PICTURE] if {"image", "holes"} & set(names) else []
    return snapshot_of(corners, material, materials, material, uvs, lights=[lamp], images=images)


def paths_of(snapshot, count):
    """What ``count`` paths a set find at the nodes of GRID."""
    scene = SceneTextures(snapshot, GRID.center, sampling_density(snapshot, GRID))
    scene.set_suns(extract_suns(snapshot.world)[1])
    check = PathCheck(GRID.count)
    directions, flux, _behind = ProbePaths(scene, snapshot, GRID, GRID.positions()).trace(0, count, None, 1)
    check.add(directions, flux, count)
    return check


@pytest.mark.any_version
def test_paths_through_a_scene_that_has_everything():
    """No other shader reads all of a scene. A name said twice in it stopped --error wherever metal and plastic met."""
    found = paths_of(room(list(FEATURES)), 4).irradiance
    assert np.isfinite(found).all() and found.mean() > 0


@pytest.mark.nightly
@pytest.mark.parametrize("names", [pytest.param(names, id=name) for name, names in mixtures()])
def test_a_bake_agrees_with_paths_whatever_the_scene_has(names):
    snapshot = room(names)
    check = paths_of(snapshot, 1024)
    for gather in (0, 1):
        field = bake(snapshot, GRID, BakeSettings(face=8, gather=gather, samples=4)).field
        assert (field.state == ACTIVE).all() and not field.offset.any()
        error = check.error_in_bands(field.coefficients)
        assert error.estimate < 0.1, (gather, error)
