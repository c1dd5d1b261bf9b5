# SPDX-License-Identifier: GPL-3.0-or-later
"""``verify`` end to end: its points, its table and its figures, on a room whose light is known."""

import json

import numpy as np
import pytest
from gridlight.cli import verify_points
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import probe_file
from gridlight.tests import scenes
from gridlight.tests.command_line import last_json

EMISSION = 2.0


@pytest.fixture(scope="module")
def furnace(tmp_path_factory):
    """A closed box of radiance 2 everywhere as a .blend, and a probe file that is exact but for a known factor."""
    folder = tmp_path_factory.mktemp("furnace")
    scene = scenes.new_scene("Furnace")
    scenes.add_box(scene, "Box", (-1, -1, -1), (1, 1, 1), scenes.emitter((1, 1, 1), EMISSION), inward=True)
    blend = folder / "furnace.blend"
    scenes.save(scene, blend)
    return blend, folder


def write_field(path, radiance):
    field = Field.empty(Grid.from_bounds([-0.8] * 3, [0.8] * 3, (2, 2, 2)), 3)
    field.coefficients[:, 0] = radiance * np.sqrt(4 * np.pi)
    field.depth[..., :2] = 10.0, 100.0
    probe_file.write(path, field)
    return path


def test_figures_and_report_of_a_field_that_is_two_percent_too_bright(furnace, run_gridlight):
    blend, folder = furnace
    probes = write_field(folder / "bright.exr", 1.02 * EMISSION)
    done = run_gridlight("verify", blend, probes, "--points", 4, "--spp", 1, "--height", 16, "--trilinear")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    summary = json.loads(lines[-1])
    for kind in ("probes", "free points", "surface points"):
        row = summary["points"][kind]
        assert row["relative_rms"] == pytest.approx(0.02, rel=1e-2)
        assert row["bias"] == pytest.approx(0.02, rel=1e-2)
        assert row["noise"] < 1e-5
        assert row["trilinear"]["relative_rms"] < 1e-4
        assert row["negative"]["count"] == row["negative"]["floor"]["count"] == 0
        assert row["points"] == 4
        assert any(line.startswith(kind) for line in lines[:-1])
        assert np.abs(row["worst_position"]).max() <= 1
    assert summary["ringing"] == {"probes": 8, "negative": 0, "lowest": 0.0}
    assert summary["files"] == [str(folder / "bright_verify.html")]
    text = (folder / "bright_verify.html").read_text(encoding="utf-8")
    assert text.count("<circle") == 3 * 3 * (4 + 1)  # three kinds in three views, and the worst one ringed
    assert text.count("+2.00 %") >= 3 * 3 * 4


def test_light_below_zero_is_counted(furnace, run_gridlight, tmp_path):
    """A field that is brighter above by more than its mean: below zero for every normal that looks down."""
    blend, _ = furnace
    field = Field.empty(Grid.from_bounds([-0.8] * 3, [0.8] * 3, (2, 2, 2)), 2)
    field.coefficients[:, 0], field.coefficients[:, 2] = 1.0, 2.0
    field.depth[..., :2] = 10.0, 100.0
    probe_file.write(tmp_path / "rings.exr", field)
    done = run_gridlight(
        "verify", blend, tmp_path / "rings.exr", "--points", 3, "--spp", 1, "--height", 16, "-o", tmp_path / "out"
    )
    assert done.returncode == 0, done.stderr
    assert "below zero" in done.stdout
    summary = last_json(done)
    negative = summary["points"]["probes"]["negative"]
    assert (negative["count"], negative["values"]) == (9, 54)
    lowest = np.pi * 0.28209479177387814 - 2 * 2 * np.pi / 3 * 0.4886025119029199
    assert negative["lowest"] == pytest.approx(lowest / (np.pi * EMISSION), rel=1e-2)
    assert negative["floor"]["count"] == 0
    assert summary["ringing"]["negative"] == 8
    assert (tmp_path / "out" / "rings_verify.html").exists()


def test_a_light_that_is_not_there_is_told(furnace, run_gridlight, tmp_path):
    scene = scenes.new_scene("Dark")
    scenes.add_box(scene, "Box", (-1, -1, -1), (1, 1, 1), scenes.diffuse((1, 1, 1)), inward=True)
    scenes.save(scene, tmp_path / "dark.blend")
    done = run_gridlight(
        "verify",
        tmp_path / "dark.blend",
        write_field(tmp_path / "p.exr", 1.0),
        "--points",
        2,
        "--spp",
        1,
        "--height",
        8,
    )
    assert done.returncode == 2
    assert "no light" in done.stderr


@pytest.mark.parametrize("arguments", [("--points", "0"), ("--spp", "0"), ("--height", "1")])
def test_wrong_options_are_refused_before_blender_starts(furnace, run_gridlight, tmp_path, arguments):
    blend, _ = furnace
    done = run_gridlight("verify", blend, write_field(tmp_path / "p.exr", 1.0), *arguments)
    assert done.returncode == 2
    assert arguments[0] in done.stderr


class TestPoints:
    """Nothing may be measured inside of solids."""

    @pytest.fixture(scope="class", params=["thick", "cube"])
    def space(self, request):
        from gridlight.scene.read import read_scene

        scene = scenes.cornell(request.param)
        space = verify_points.FreeSpace(read_scene(scene), verify_points.cycles_light(scene))
        space.is_free(Grid.from_bounds([-0.1] * 3, [2.9] * 3, (3, 3, 3)).positions())  # nodes vote first, as in verify
        return space

    @pytest.mark.any_version
    def test_free_points_stand_in_the_room_and_outside_its_boxes(self, space):
        """Also where the volume reaches into the walls and beyond them."""
        for low, high in ((0.05, 2.75), (-0.1, 2.9)):
            points = verify_points.free_points(space, Grid.from_bounds([low] * 3, [high] * 3, (4, 4, 4)), 100, 0)
            assert points.shape == (100, 3)
            assert ((points > 0) & (points < scenes.ROOM_SIZE_M)).all()
            assert not _in_box(points, (1.05, 1.85), 0.8, 1.55, 0.29).any()
            assert not _in_box(points, (1.875, 0.875), 0.75, 0.75, -0.31).any()

    def test_the_same_seed_gives_the_same_points(self, space):
        grid = Grid.from_bounds([0.05] * 3, [2.75] * 3, (4, 4, 4))
        first, second = (verify_points.free_points(space, grid, 20, 5) for _ in range(2))
        np.testing.assert_array_equal(first, second)

    def test_surface_points_look_into_the_room(self, space):
        grid = Grid.from_bounds([0.1] * 3, [2.7] * 3, (4, 4, 4))
        points, normals = verify_points.surface_points(space, grid, 60, 0)
        assert len(points) == 60
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, rtol=1e-9)
        ahead = points + 0.02 * normals
        assert ((ahead > 0) & (ahead < scenes.ROOM_SIZE_M)).all()


def test_a_dark_room_beside_a_lit_one_is_free_space():
    """What leaks into it must be measured."""
    from gridlight.scene.read import read_scene

    scene = scenes.lit_and_dark_rooms()
    space = verify_points.FreeSpace(read_scene(scene), verify_points.cycles_light(scene))
    points = np.array([[1.0, 1.0, 1.0], [3.6, 1.2, 1.5], [4.9, 0.2, 0.3], [2.55, 1.0, 1.0], [1.0, 1.0, -0.1]])
    np.testing.assert_array_equal(space.is_free(points), [True, True, True, False, False])


def _in_box(points, middle, width, height, turn):
    """(N,) bool: inside of a box on the floor, turned about the vertical."""
    x, y = (points[:, :2] - middle).T
    u, v = np.cos(turn) * x + np.sin(turn) * y, -np.sin(turn) * x + np.cos(turn) * y
    return (np.abs(u) < width / 2) & (np.abs(v) < width / 2) & (points[:, 2] < height)


@pytest.mark.parametrize(
    "turn, height",
    [(0.7, 32), *(pytest.param(*odd, marks=pytest.mark.any_version) for odd in ((np.pi / 2, 32), (1.9, 29)))],
    ids=["plain", "on the seam of the panorama", "odd size"],
)
def test_a_sun_disc_of_the_sky_is_not_missed(turn, height):
    """Nothing but a sky with a sun of half a degree, which few samples of a pixel of six meet: irradiance must be that
    of the sky rendered for the bake, whose sun has thousands."""
    from gridlight.core.panorama import panorama_irradiance
    from gridlight.core.world_suns import extract_suns
    from gridlight.scene.cycles_reference import render_panoramas
    from gridlight.scene.read import read_scene

    scene = scenes.new_scene("Sun disc")
    scenes.add_box(scene, "Far below", (-0.1, -0.1, -9.1), (0.1, 0.1, -9), scenes.diffuse((0.0, 0.0, 0.0)))
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    sky = nodes.new("ShaderNodeTexSky")
    kinds = [item.identifier for item in sky.bl_rna.properties["sky_type"].enum_items]
    sky.sky_type = "MULTIPLE_SCATTERING" if "MULTIPLE_SCATTERING" in kinds else "NISHITA"
    sky.sun_elevation, sky.sun_rotation = 0.6, turn
    links.new(sky.outputs["Color"], next(node for node in nodes if node.type == "BACKGROUND").inputs["Color"])
    world = read_scene(scene).world
    expected = panorama_irradiance(world.map, verify_points.SIX_NORMALS)
    suns = extract_suns(world)[1]
    assert len(suns) == 1
    found, without = (
        panorama_irradiance(
            render_panoramas(scene, [[0, 0, 0]], 2 * height, height, 4, suns=there)[0], verify_points.SIX_NORMALS
        )
        for there in (suns, [])
    )
    scale = np.sqrt((expected**2).mean())
    assert np.abs(found - expected).max() < 0.05 * scale
    assert np.abs(without - expected).max() > 0.2 * scale, "the test can fail"
