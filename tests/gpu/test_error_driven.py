# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths against closed forms, and bakes that are given an error: what they choose, keep and say."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.error_driven import ErrorDrivenBake
from gridlight.bake.result import Silent
from gridlight.bake.session import BakeSession
from gridlight.core import patches
from gridlight.core.error_budget import ErrorGoal
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_irradiance
from gridlight.core.path_check import NORMALS, PathCheck, irradiance_of
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Material, World
from gridlight.core.world_suns import extract_suns
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import all_lights, box, cluttered_room, furnace, snapshot_of

GRID = Grid.from_bounds((-0.7, -0.7, -0.6), (0.7, 0.7, 0.7), (2, 2, 2))
NO_EMITTERS = 0.0


def checked(snapshot, positions, paths, bounces=None):
    scene = SceneTextures(snapshot, GRID.center, np.full(len(snapshot.triangles), NO_EMITTERS))
    scene.set_suns(extract_suns(snapshot.world)[1])
    check = PathCheck(len(positions))
    directions, flux, _behind = ProbePaths(scene, snapshot, GRID, positions).trace(0, paths // 4, bounces, 1)
    check.add(directions, flux, paths // 4)
    return check


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.9])
def test_paths_in_a_furnace_find_its_closed_form(albedo):
    check = checked(furnace(albedo), GRID.positions(), 4096)
    np.testing.assert_allclose(check.irradiance.mean(), np.pi / (1 - albedo), rtol=0.01)


def test_paths_stop_after_the_bounces_asked_for():
    """Emission E and albedo a: n bounces give E (1 + a + … + aⁿ⁺¹), of which the first term is seen, not bounced."""
    for bounces in (1, 2, 5):
        found = checked(furnace(0.5), GRID.positions(), 1024, bounces).irradiance.mean()
        np.testing.assert_allclose(found, np.pi * sum(0.5**n for n in range(bounces + 1)), rtol=0.01)


def test_paths_see_the_sky():
    snapshot = replace(snapshot_of(box((5, 5, 5), (5.01, 5.01, 5.01))), world=World((1.0, 2.0, 3.0)))
    found = checked(snapshot, GRID.positions(), 512).irradiance
    np.testing.assert_allclose(found.mean(axis=(0, 1, 2)), np.pi * np.array([1, 2, 3]), rtol=0.01)


def test_paths_see_the_sun_of_a_map():
    """An even sky with one very bright spot: the integral over the map's own pixels."""
    pixels = np.full((32, 64, 3), 0.2, np.float32)
    pixels[22, 10] = 400.0, 300.0, 200.0
    snapshot = replace(snapshot_of(box((5, 5, 5), (5.01, 5.01, 5.01))), world=World(map=pixels))
    found = checked(snapshot, GRID.positions(), 512).irradiance.mean(axis=(0, 1))
    # the lamp in the sun's place is a disc where the map has a square: half a percent
    np.testing.assert_allclose(found, panorama_irradiance(pixels, NORMALS), rtol=0.01, atol=0.01)


@pytest.mark.parametrize("sampled", [False, True])
def test_paths_see_an_emitter_sampled_or_not(sampled):
    """A black room with a square plate that glows on both sides: its irradiance by a fine sum over the plate."""
    plate = np.array(
        [[[-0.2, -0.2, 0], [0.2, -0.2, 0], [0.2, 0.2, 0]], [[-0.2, -0.2, 0], [0.2, 0.2, 0], [-0.2, 0.2, 0]]]
    )
    materials = [Material("black", (0.0,) * 3), Material("plate", (0.0,) * 3, emission=(3.0, 2.0, 1.0))]
    corners = np.concatenate([3 * box()[:, ::-1], plate])
    material = [0] * 12 + [1] * 2
    snapshot = snapshot_of(corners, material, materials, objects=material)
    density = np.array([0.0] * 12 + [float(sampled) / 0.16] * 2)
    places = GRID.positions()
    scene = SceneTextures(snapshot, GRID.center, density)
    check = PathCheck(len(places))
    directions, flux, _behind = ProbePaths(scene, snapshot, GRID, places).trace(0, 1024, None, 0)
    check.add(directions, flux, 1024)
    at = np.stack(np.meshgrid(*2 * [(np.arange(64) + 0.5) / 160 - 0.2], [0.0]), axis=-1).reshape(-1, 3)
    offset = at - places[:, None]
    distance = np.linalg.norm(offset, axis=2)
    towards = offset / distance[..., None]
    solid_angle = np.abs(towards[..., 2]) / distance**2 * 0.16 / len(at)
    expected = np.einsum("ks,ksn->kn", solid_angle, np.maximum(towards @ NORMALS.T, 0))[..., None] * [3.0, 2.0, 1.0]
    found = check.irradiance.mean(axis=0)
    assert np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean()) < (0.02 if sampled else 0.15)
    np.testing.assert_allclose(found.sum(), expected.sum(), rtol=0.02 if sampled else 0.1)


def driven(snapshot, target, kept=(), **settings):
    job = BakeJob(snapshot, GRID, BakeSettings(**settings))
    bake = ErrorDrivenBake(job, ErrorGoal(target, frozenset(kept)), Silent())
    for _ in bake.bake():
        pass
    return bake.result


def room():
    return cluttered_room({name: light for name, light in all_lights().items() if name in ("point", "rectangle")})


@pytest.mark.nightly
def test_the_predicted_error_is_that_against_a_fine_bake():
    """The reference is a bake too, but of 16 times the texels and 8 times the samples; paths have no part in it."""
    result = driven(room(), 0.04, kept=["bands"])
    fine = BakeSession(BakeJob(room(), GRID, BakeSettings(face=32, samples=8, seed=99)), Silent())
    for _ in fine.bake():
        pass
    active = result.field.state == 1
    found, exact = (irradiance_of(f.coefficients[active], NORMALS) for f in (result.field, fine.result.field))
    within_bands = np.sqrt(((found - exact) ** 2).mean() / (exact**2).mean())
    error = result.error
    assert error["met"] and within_bands <= 0.04
    # eight probes and few paths: the bound is what they can promise
    assert np.hypot(within_bands, error["parts"]["floor"]) <= 1.2 * error["predicted_at_most"] <= 1.2 * 0.04


@pytest.mark.any_version
def test_what_is_given_is_kept_and_the_same_comes_out_again():
    first, second = (driven(room(), 0.05, kept=["face", "bands"], face=9, bands=2) for _ in range(2))
    assert (first.settings.face, first.settings.bands) == (9, 2)
    assert first.error == second.error
    for name in ("coefficients", "gradient", "depth", "offset"):
        assert getattr(first.field, name).tobytes() == getattr(second.field, name).tobytes()


@pytest.mark.nightly
def test_more_passes_make_it_better_and_go_where_they_are_needed(monkeypatch):
    monkeypatch.setattr(patches, "_MANY", 1)  # no more rays than asked for, so that noise is what is wrong
    grid = Grid.from_bounds((-0.7, -0.7, -0.6), (0.7, 0.7, 0.7), (4, 4, 4))
    bake = ErrorDrivenBake(
        BakeJob(room(), grid, BakeSettings(face=12)), ErrorGoal(0.012, frozenset({"face", "bands"})), Silent()
    )
    for _ in bake.bake():
        pass
    passes = [int(told.split()[-2]) for told in bake.result.error["passes"]]
    assert len(passes) > 1 and passes[0] == passes[1] == bake.result.counts["active"] and passes[-1] <= passes[0]
    once = BakeSession(BakeJob(room(), grid, bake.result.settings), Silent())
    once.settings = replace(once.settings, samples=1)
    fine = BakeSession(BakeJob(room(), grid, BakeSettings(face=32, samples=32, seed=99)), Silent())
    for session in (once, fine):
        for _ in session.bake():
            pass
    active = bake.result.field.state == 1
    found, first, exact = (
        irradiance_of(field.coefficients[active], NORMALS)
        for field in (bake.result.field, once.result.field, fine.result.field)
    )
    assert ((found - exact) ** 2).mean() < ((first - exact) ** 2).mean()


@pytest.mark.any_version
def test_a_target_below_the_floor_is_refused_in_words_and_the_floor_is_told():
    result = driven(room(), 0.001, kept=["samples", "face"], face=8)
    assert not result.error["met"] and result.error["predicted"] > 0.001
    assert any("was not reached" in warning and "3 bands alone lose" in warning for warning in result.warnings)


def test_even_light_needs_one_band():
    result = driven(furnace(0.5), 0.1)
    assert result.error["met"] and result.field.bands == 1
    np.testing.assert_allclose(result.field.coefficients[:, 0], 2.0 * np.sqrt(4 * np.pi), rtol=2e-2)


def test_without_light_there_is_no_error_to_tell():
    result = driven(snapshot_of(box(), materials=[Material("grey")]), 0.02)
    assert result.error["predicted"] is None and any("no light" in warning for warning in result.warnings)
