# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo gallery: what it must contain, that its walls are solid, and that culling leaves 295 of its 308 probes."""

import bpy  # first, because the wheel brings bmesh with it

import bmesh  # isort: skip
import numpy as np
import pytest
from gridlight.core.culling import needed_nodes
from gridlight.core.grid import Grid
from gridlight.scene.gallery import FIRST_FRAME, LAST_FRAME, build_gallery
from gridlight.scene.read import read_scene


@pytest.fixture(scope="module")
def gallery():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return build_gallery()


@pytest.fixture(scope="module")
def snapshot(gallery):
    return read_scene(gallery)


@pytest.fixture(scope="module")
def grid(snapshot):
    (volume,) = snapshot.volumes
    return Grid(volume.matrix, volume.resolution, volume.name)


def test_size_and_contents(snapshot, gallery):
    assert 10_000 <= len(snapshot.triangles) <= 25_000
    assert snapshot.warnings == []
    assert snapshot.volumes[0].resolution == (11, 4, 7)
    groups = {light.group: light for light in snapshot.lights}
    assert set(groups) == {"ceiling1", "ceiling2", "dynamic"}
    assert [name for name, light in groups.items() if light.dynamic] == ["dynamic"]
    assert "wall" in {item.get("gridlight_group") for item in gallery.objects}
    assert any(max(material.emission) > 0 for material in snapshot.materials)
    assert len(snapshot.images) == 5 and all(image.packed_file for image in bpy.data.images if image.users)
    plain = [material for material in snapshot.materials if material.base_image < 0]
    assert max(max(material.base_color) for material in plain) <= 0.85
    assert max(image.pixels[..., :3].max() for image in snapshot.images) <= 0.85
    assert gallery.camera.name == "Gallery Camera"


def test_culling_leaves_295_of_308(snapshot, grid):
    needed = needed_nodes(grid, snapshot.triangle_positions)
    assert (len(needed), int(needed.sum())) == (308, 295)
    culled = grid.lattice()[~needed]
    # The three columns of air in the hall, and one node south of the tall sculptures.
    assert sorted(map(tuple, culled)) == sorted([(4, 0, 2), *((i, j, 3) for i in (4, 5, 6) for j in range(4))])


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shift", (-0.03, 0.03))
def test_no_culling_decision_is_close(snapshot, grid, axis, shift):
    moved = snapshot.triangle_positions + shift * np.eye(3)[axis]
    assert np.array_equal(needed_nodes(grid, moved), needed_nodes(grid, snapshot.triangle_positions))


def winding_numbers(points, triangles):
    """(N,) how often the surface winds around each point: van Oosterom and Strackee's solid angles over 4π."""
    numbers = []
    for point in points:
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        numbers.append(np.arctan2(volume, below).sum() / (2 * np.pi))
    return np.array(numbers)


def test_no_probe_is_inside_anything(snapshot, grid):
    # The shell is a solid with hollow rooms, so "not inside any solid" is winding number 0, in the rooms too.
    numbers = winding_numbers(grid.positions(), snapshot.triangle_positions)
    assert np.abs(numbers).max() < 1e-6
    in_the_wall = np.array([[4.85, 3.0, 1.0], [0, 3.95, 4.0], [8, 0, 3.45]])
    assert np.allclose(winding_numbers(in_the_wall, snapshot.triangle_positions), 1, atol=1e-6)


def test_every_mesh_is_closed_and_faces_outwards(gallery):
    for mesh in {item.data for item in gallery.objects if item.type == "MESH"}:
        shape = bmesh.new()
        shape.from_mesh(mesh)
        open_edges = [edge for edge in shape.edges if not edge.is_manifold]
        inverted = [edge for edge in shape.edges if edge.is_manifold and not edge.is_contiguous]
        volume = shape.calc_volume(signed=True)
        shape.free()
        assert not open_edges and not inverted and volume > 0, mesh.name


def test_the_lamp_glides_through_free_air_and_comes_back(gallery, snapshot):
    lamp = next(item for item in gallery.objects if item.get("gridlight_group") == "dynamic")
    places = []
    for frame in range(FIRST_FRAME, LAST_FRAME + 1, 3):
        gallery.frame_set(frame)
        places.append(np.array(lamp.matrix_world.translation))
    gallery.frame_set(FIRST_FRAME)
    places = np.array(places)
    assert np.abs(winding_numbers(places, snapshot.triangle_positions)).max() < 1e-6
    corners = snapshot.triangle_positions.reshape(-1, 3)
    nearest = [np.linalg.norm(corners - place, axis=1).min() for place in places]
    assert min(nearest) > 1.5 * lamp.data.shadow_soft_size
    assert np.ptp(places[:, 0]) > 14
    assert np.linalg.norm(places[0] - places[-1]) < 0.2


def test_two_galleries_are_the_same_and_the_scene_given_is_used():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    first = read_scene(build_gallery())
    mine = bpy.data.scenes.new("Mine")
    assert build_gallery(mine) is mine
    second = read_scene(mine)
    assert np.array_equal(first.vertices, second.vertices)
    assert all(np.array_equal(a.pixels, b.pixels) for a, b in zip(first.images, second.images))
