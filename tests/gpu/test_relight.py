# SPDX-License-Identifier: GPL-3.0-or-later
"""A relit bake is a fresh bake of the changed scene, and its counters show what was not done for it."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.block_session import open_session
from gridlight.bake.job import drive
from gridlight.bake.result import Silent
from gridlight.bake.session import BakeSession
from gridlight.core.gloss import Gloss
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import FROM_BEHIND, Image, Light, Material, World
from gridlight.tests.changed_snapshots import with_light, with_material, with_moved
from small_scenes import bake, box, frame, snapshot_of

SETTINGS = {"face": 8, "tolerance": 1e-6, "capture": "trace"}


def rooms(**options):
    """Two rooms of 2 m side by side with a door between them, a box in the second, a lamp that glows in the first, and
    a window to the sky in the second."""
    shell = box((-2, -1, -1), (2, 1, 1))[:, ::-1]
    wall = np.concatenate([box((-0.05, -1, -1), (0.05, 0.3, 1)), box((-0.05, 0.3, 0.5), (0.05, 1, 1))])
    furniture = box((1.1, -0.7, -1), (1.5, -0.2, -0.4))
    glowing = box((-1.4, -0.1, 0.7), (-1.2, 0.1, 0.8))
    leaf = np.array([[[-0.6, -0.9, -0.9], [-0.6, 0.2, -0.9], [-0.6, -0.4, 0.3]]])
    corners = np.concatenate([shell, wall, furniture, glowing, leaf])
    sizes = [len(part) for part in (shell, wall, furniture, glowing, leaf)]
    corners = np.delete(corners, 5, axis=0)  # half of a side: the window
    sizes[0] -= 1
    objects = np.repeat(np.arange(5), sizes)
    generator = np.random.default_rng(0)
    pixels = generator.random((8, 8, 4)).astype(np.float32)
    pixels[..., 3] = pixels[..., 0] > 0.4
    materials = [
        Material("wall", (0.7, 0.7, 0.7), base_image=0),
        Material("partition", (0.6, 0.2, 0.2), faint_gloss=Gloss((0.1, 0.1, 0.1), (0.04, 0.04, 0.04), 0.5, True)),
        Material("wood", (0.5, 0.4, 0.3)),
        Material("bulb", (0.1, 0.1, 0.1), emission=(20.0, 18.0, 15.0)),
        Material("leaf", (0.2, 0.7, 0.2), alpha_image=1, alpha_threshold=0.5),
    ]
    lights = [
        Light("lamp", "POINT", (3.0, 3.0, 3.0), frame((-1.0, 0.4, 0.2)), radius=0.1),
        Light("spot", "SPOT", (6.0, 5.0, 4.0), frame((1.2, 0.5, 0.9)), radius=0.05, spot_size=1.4, spot_blend=0.3),
        Light("sun", "SUN", (2.0, 2.0, 1.5), frame(towards=(-0.5, 0.3, -0.6))),
    ]
    return snapshot_of(
        corners + generator.normal(0, 0.004, 3),
        objects,
        materials,
        objects,
        generator.uniform(0, 2, (len(corners), 3, 2)),
        images=[Image("checks", pixels), Image("holes", pixels)],
        lights=options.pop("lights", lights),
        world=options.pop("world", World((0.3, 0.4, 0.6))),
        **options,
    )


def grid(resolution=(4, 2, 2)):
    return Grid.from_bounds((-1.7, -0.8, -0.8), (1.7, 0.8, 0.8), resolution)


def followed(steps):
    drive(steps, lambda: False)


def session_of(snapshot, where=None, **settings):
    session = BakeSession(BakeJob(snapshot, where or grid(), BakeSettings(**{**SETTINGS, **settings})), Silent())
    followed(session.bake())
    return session


def without(snapshot, item):
    keep = snapshot.object_index != item
    arrays = {
        name: getattr(snapshot, name)[keep]
        for name in ("triangles", "corner_normals", "corner_uvs", "material_index", "object_index")
    }
    return replace(snapshot, **arrays)


def assert_same_bake(found, expected):
    """Field, states and statistics agree to 1e-5."""
    np.testing.assert_array_equal(found.field.state, expected.field.state)
    np.testing.assert_allclose(found.field.offset, expected.field.offset, atol=1e-6)
    scale = np.abs(expected.field.coefficients).max()
    apart = np.abs(found.field.coefficients - expected.field.coefficients).max(axis=(1, 2)) / scale
    differ = apart > 1e-5
    assert not differ.any(), f"probes {np.flatnonzero(differ)} differ, by {apart[differ]} of the largest coefficient"
    np.testing.assert_allclose(found.field.depth, expected.field.depth, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(found.field.validity, expected.field.validity, atol=1e-5)
    assert found.counts == expected.counts


@pytest.fixture(scope="module")
def session(gpu_context):
    """One bake of the rooms; each test relights it there and back, so errors would add up."""
    return session_of(rooms())


@pytest.fixture(scope="module")
def raster_session(gpu_context):
    return session_of(rooms(), capture="raster")


def relit_there_and_back(session, change):
    """The result of relighting for ``change``, after which the session is brought back to the rooms."""
    followed(session.relight(change(rooms())))
    result = session.result
    followed(session.relight(rooms()))
    return result


NO_CAPTURE = {
    "a light's colour": lambda s: with_light(s, 0, color=(5.0, 1.0, 1.0)),
    "a light less": lambda s: replace(s, lights=s.lights[:2]),
    "a light more": lambda s: replace(s, lights=[*s.lights, replace(s.lights[0], name="other")]),
    "a light that moved": lambda s: with_light(s, 0, matrix=frame((-0.6, -0.5, 0.5))),
    "a map for a world": lambda s: replace(
        s, world=World(map=np.random.default_rng(1).random((16, 32, 3)).astype(np.float32))
    ),
    "emission": lambda s: with_material(s, 3, emission=(3.0, 9.0, 30.0)),
    "no emission": lambda s: with_material(s, 3, emission=(0.0, 0.0, 0.0)),
    "emission of a wall": lambda s: with_material(s, 0, emission=(0.2, 0.1, 0.3)),
    "reflectance": lambda s: with_material(s, 1, base_color=(0.1, 0.2, 0.8)),
    "gloss of all directions": lambda s: with_material(s, 1, faint_gloss=Gloss((0.2, 0.2, 0.2), (0.1, 0.1, 0.1), 0.6)),
    "a texture": lambda s: replace(
        s, images=[replace(s.images[0], pixels=s.images[0].pixels * np.float32([0.5, 1, 1, 1])), s.images[1]]
    ),
}
SHAPES = {
    "an object moved": (lambda s: with_moved(s, 2, (0.1, 0.4, 0.0)), "refit"),
    "an emitter moved": (lambda s: with_moved(s, 3, (0.3, 0.2, -0.1)), "refit"),
    "an object left": (lambda s: without(s, 2), "rebuilt"),
    "a leaf without holes": (lambda s: with_material(s, 4, alpha_threshold=0.0), "refit"),
    "a leaf that glows on one side": (
        lambda s: with_material(s, 4, emission=(5.0, 3.0, 1.0), unseen_by=FROM_BEHIND),
        "refit",
    ),
    "much at once": (
        lambda s: with_material(
            with_light(replace(with_moved(s, 2, (0.1, 0.4, 0)), world=World((0.1, 0.1, 0.1))), 0, color=(1.0, 0, 0)),
            0,
            base_color=(0.3, 0.3, 0.9),
        ),
        "refit",
    ),
}


SELDOM = {"a light more", "no emission", "emission of a wall", "a leaf without holes", "a leaf that glows on one side"}


ONCE = {
    "a light's colour",
    "a light less",
    "a map for a world",
    "emission",
    "reflectance",
    "an emitter moved",
    "an object left",
    "much at once",
}


def cases(table):
    """Names of ``table``; the less telling ones run nightly, those that run the same passes as others once."""
    marks = {**dict.fromkeys(SELDOM, pytest.mark.nightly), **dict.fromkeys(ONCE, pytest.mark.any_version)}
    return [pytest.param(name, marks=marks.get(name, ())) for name in table]


@pytest.mark.parametrize("name", cases(NO_CAPTURE))
def test_no_probe_captures_when_no_shape_changed(name, session):
    result = relit_there_and_back(session, NO_CAPTURE[name])
    relit = result.relit
    assert relit.probes_captured == 0 and relit.hierarchy == "kept", relit
    is_lamp = "light" in name
    assert relit.patches_traced == (0 if is_lamp else relit.patches), relit
    assert_same_bake(result, bake(NO_CAPTURE[name](rooms()), grid(), session.settings))


def check_shape(name, session):
    change, hierarchy = SHAPES[name]
    result = relit_there_and_back(session, change)
    assert result.relit.hierarchy == hierarchy
    assert 0 < result.relit.probes_captured < result.relit.probes, result.relit
    assert_same_bake(result, bake(change(rooms()), grid(), session.settings))


@pytest.mark.parametrize("name", cases(SHAPES))
def test_only_probes_that_can_see_a_change_capture(name, session):
    check_shape(name, session)


@pytest.mark.any_version
@pytest.mark.parametrize("name", ["an object moved", "an object left"])
def test_the_same_with_rasterised_surfaces(name, raster_session):
    check_shape(name, raster_session)


def test_after_all_that_the_rooms_are_what_they_were(session):
    assert_same_bake(session.result, bake(rooms(), grid(), session.settings))


def test_nothing_is_done_for_nothing(session):
    before = session.result.field
    followed(session.relight(replace(rooms(), name="again", frame=3)))
    relit = session.result.relit
    assert session.result.field is before and relit.changes == ["nothing changed"]
    assert (relit.probes_captured, relit.patches_lit, relit.patches_traced, relit.iterations) == (0, 0, 0, 0)


def test_small_changes_go_on_from_the_light_before(session):
    """From the old light to the same end in fewer steps."""
    new = with_light(rooms(), 0, color=(3.05, 3.0, 3.0))
    result = relit_there_and_back(session, lambda _: new)
    fresh = bake(new, grid(), session.settings)
    assert result.relit.warm_start and result.iterations < fresh.iterations
    assert_same_bake(result, fresh)


def test_large_changes_begin_in_the_dark(session):
    assert not relit_there_and_back(session, lambda s: replace(s, lights=[])).relit.warm_start


@pytest.mark.any_version
def test_what_turns_black_is_bound_anew(session):
    """Surfaces that reflect nothing have no patches; only probes that had been moved out of walls capture for that."""
    new = with_material(rooms(), 2, base_color=(0.0, 0.0, 0.0))
    moved = np.any(session.result.field.offset, axis=1).sum()
    result = relit_there_and_back(session, lambda _: new)
    assert result.relit.probes_captured <= 3 * moved
    assert_same_bake(result, bake(new, grid(), session.settings))


@pytest.mark.any_version
def test_a_number_of_bounces_is_that_many():
    session = session_of(rooms(), bounces=2)
    new = with_light(rooms(), 0, color=(3.05, 3.0, 3.0))
    followed(session.relight(new))
    assert session.result.iterations == 3 and not session.result.relit.warm_start
    assert_same_bake(session.result, bake(new, grid(), session.settings))


def sunny(row, column):
    """A dim sky with a small sun in it."""
    sky = np.full((64, 128, 3), 0.2, np.float32)
    sky[row, column] = 4000.0
    return World(map=sky)


@pytest.mark.any_version
def test_suns_of_the_world_come_move_and_go():
    """They are lamps behind the scene's own in the list."""
    where = grid((2, 1, 1))
    session = session_of(replace(rooms(), world=sunny(50, 30)), where)
    assert session.backend.scene.lamp_count == len(rooms().lights) + 1
    for new in (
        replace(rooms(), world=sunny(52, 90)),
        replace(rooms(), world=sunny(52, 90), lights=rooms().lights[:1]),
        replace(rooms(), lights=rooms().lights[:1]),
        replace(rooms(), world=sunny(50, 30)),
    ):
        followed(session.relight(new))
        assert session.result.relit.probes_captured == 0
        assert_same_bake(session.result, bake(new, where, session.settings))


def check_blocks(where, changes, captures, **settings):
    """Relights ``where`` in two blocks for one change after the other."""
    settings = BakeSettings(**{**SETTINGS, "block": where.count // 2, "bounces": 3, **settings})
    session = open_session(BakeJob(rooms(), where, settings), Silent())
    followed(session.bake())
    for new, captures_few in zip(changes, captures):
        followed(session.relight(new))
        assert_same_bake(session.result, bake(new, where, settings))
        assert (session.result.relit.probes_captured < where.count // 2) == captures_few
    return session


MOVED = with_moved(rooms(), 2, (0.1, 0.4, 0.0))


@pytest.mark.any_version
def test_relighting_several_blocks():
    """Blocks keep their texel surfaces while only lamps differ, if the memory budget lets them."""
    session = check_blocks(grid((4, 2, 1)), [with_light(rooms(), 0, color=(1.0, 3.0, 3.0))], [True], face=5)
    assert len(session.open_blocks) == 2


@pytest.mark.nightly
@pytest.mark.parametrize("memory_mib", [512, 16], ids=["kept", "given up"])
def test_relighting_several_blocks_anew(memory_mib):
    """Where shapes differ, or surfaces of blocks do not fit the budget together, all is anew."""
    where, face = (grid(), 8) if memory_mib == 512 else (grid((6, 6, 3)), 32)
    changes = [with_light(rooms(), 0, color=(1.0, 3.0, 3.0)), MOVED]
    session = check_blocks(where, changes, [memory_mib == 512, False], face=face, memory_mib=memory_mib)
    assert (len(session.open_blocks) == 1) == (memory_mib == 16)


@pytest.mark.nightly
def test_relighting_with_a_final_gather():
    session = session_of(rooms(), gather=1)
    for new in (with_light(rooms(), 0, color=(1.0, 3.0, 3.0)), with_moved(rooms(), 2, (0.1, 0.4, 0.0))):
        followed(session.relight(new))
        assert_same_bake(session.result, bake(new, grid(), session.settings))


def test_probes_come_and_go_with_surfaces():
    """A cell that surface leaves needs no probe any more, and the other way round."""
    wall, island = box((0.4, -1.5, -1.5), (0.5, 1.5, 1.5)), box((2.4, -0.2, -0.2), (2.6, 0.2, 0.2))
    scene = snapshot_of(
        np.concatenate([wall, island])
        + (0.0031, 0.0017, -0.0023),  # no ray runs along an edge, where either side is met
        objects=[0] * 12 + [1] * 12,
        lights=rooms().lights,
        world=World((0.2, 0.2, 0.2)),
    )
    where = Grid.from_bounds((-3, -1, -1), (3, 1, 1), (7, 3, 3))
    session = session_of(scene, where)
    before = session.result.field.state
    for offset in (-1.2, -4.8):
        new = with_moved(scene, 1, (offset, 0.0, 0.0))
        followed(session.relight(new))
        relit = session.result.relit
        assert (session.result.field.state != before).any()
        assert 0 < relit.probes_captured < relit.probes or offset < -3
        assert_same_bake(session.result, bake(new, where, session.settings))


@pytest.mark.nightly
def test_surfaces_that_do_not_fit_are_captured_again():
    """Beyond the memory budget relighting is right, too, if not cheap."""
    where = grid((6, 6, 6))
    session = session_of(rooms(), where, memory_mib=16, face=24, tolerance=1e-5)
    assert any("memory budget" in note for note in session.result.notes)
    for new in (with_light(rooms(), 0, color=(1.0, 3.0, 3.0)), with_moved(rooms(), 2, (0.1, 0.4, 0.0))):
        followed(session.relight(new))
        assert_same_bake(session.result, bake(new, where, session.settings))
