# SPDX-License-Identifier: GPL-3.0-or-later
"""What a relight is told about two snapshots: each kind of change alone, and that nothing else is reported."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.scene_changes import MOST_BOXES, boxes_around, compare
from gridlight.core.snapshot import Image, Light, Material, SceneSnapshot, World
from gridlight.tests.changed_snapshots import with_light, with_material, with_moved

TRIANGLES = 60
OBJECTS = ["Floor", "Lamp", "Chair", "Chair", "Tree"]


def scene(seed=0):
    """Loose triangles of five objects with three materials, two of them textured, and three lights."""
    generator = np.random.default_rng(seed)
    corners = generator.uniform(-1, 1, (TRIANGLES, 1, 3)) + generator.normal(0, 0.1, (TRIANGLES, 3, 3))
    normals = np.repeat(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None], 3, axis=1)
    pixels = generator.random((4, 4, 4)).astype(np.float32)
    return SceneSnapshot(
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * TRIANGLES, dtype=np.int32).reshape(-1, 3),
        corner_normals=(normals / np.linalg.norm(normals, axis=-1, keepdims=True)).astype(np.float32),
        corner_uvs=generator.random((TRIANGLES, 3, 2)).astype(np.float32),
        material_index=(np.arange(TRIANGLES) % 3).astype(np.int32),
        object_index=np.sort(np.arange(TRIANGLES) % len(OBJECTS)).astype(np.int32),
        object_names=list(OBJECTS),
        materials=[
            Material("plain"),
            Material("picture", base_image=0),
            Material("leaf", emission=(1.0, 1.0, 1.0), alpha_image=1, alpha_threshold=0.5),
        ],
        images=[Image("bricks", pixels), Image("leaf", 1 - pixels)],
        lights=[Light(name, "POINT", (1.0, 1.0, 1.0), np.eye(4)) for name in "abc"],
        world=World((0.1, 0.2, 0.3)),
    )


def copied(snapshot):
    """The same scene read again: equal arrays that are not the same."""
    return replace(
        snapshot,
        **{
            name: getattr(snapshot, name).copy()
            for name in ("vertices", "triangles", "corner_normals", "corner_uvs", "material_index", "object_index")
        },
        images=[replace(image, pixels=image.pixels.copy()) for image in snapshot.images],
        lights=[replace(light, matrix=light.matrix.copy()) for light in snapshot.lights],
    )


def flags(changes):
    """The kinds of change reported."""
    kinds = {name for name in ("world", "emission", "reflectance") if getattr(changes, name)}
    return (
        kinds
        | ({"lights"} if changes.any_light else set())
        | ({"shape"} if changes.shape and not changes.shape.only_order else set())
    )


def reordered(snapshot, order):
    """The same objects in another order, each with its own triangles and vertices."""
    rows = np.concatenate([np.empty(0, int), *(np.flatnonzero(snapshot.object_index == i) for i in order)])
    return replace(
        snapshot,
        vertices=snapshot.vertices[snapshot.triangles[rows]].reshape(-1, 3),
        triangles=np.arange(3 * len(rows), dtype=np.int32).reshape(-1, 3),
        corner_normals=snapshot.corner_normals[rows],
        corner_uvs=snapshot.corner_uvs[rows],
        material_index=snapshot.material_index[rows],
        object_index=np.repeat(np.arange(len(order)), [int((snapshot.object_index == i).sum()) for i in order]).astype(
            np.int32
        ),
        object_names=[snapshot.object_names[i] for i in order],
    )


def test_the_same_scene_read_again_is_no_change():
    changes = compare(scene(), copied(scene()))
    assert changes.nothing and not flags(changes) and not changes.materials
    assert changes.describe() == ["nothing changed"]


def test_names_frames_and_marks_are_no_change():
    old = scene()
    new = replace(with_light(old, 1, name="other", group="WALL", dynamic=True), name="Other", frame=7, exposure=2.0)
    assert compare(old, with_material(new, 0, name="renamed", backface_culling=True)).nothing


@pytest.mark.parametrize(
    "values,moves",
    [
        ({"color": (2.0, 1.0, 1.0)}, False),
        ({"radius": 0.2}, True),
        ({"casts_shadow": False}, True),
        ({"matrix": np.diag([1.0, 1, 1, 1]) + np.eye(4, k=3)}, True),
    ],
)
def test_one_light(values, moves):
    changes = compare(scene(), with_light(scene(), 1, **values))
    assert flags(changes) == {"lights"}
    np.testing.assert_array_equal(changes.lights, [False, True, False])
    assert changes.lights_moved == (("b",) if moves else ())


def test_lights_that_come_and_go():
    old = scene()
    fewer = compare(old, replace(old, lights=old.lights[:2]))
    assert fewer.lights_removed == 1 and not fewer.lights.any() and flags(fewer) == {"lights"}
    more = compare(replace(old, lights=old.lights[:2]), old)
    np.testing.assert_array_equal(more.lights, [False, False, True])
    assert flags(compare(old, replace(old, lights=[]))) == {"lights"}


@pytest.mark.parametrize("world", [World((0.1, 0.2, 0.4)), World((0.1, 0.2, 0.3), np.ones((2, 4, 3), np.float32))])
def test_world(world):
    assert flags(compare(scene(), replace(scene(), world=world))) == {"world"}


@pytest.mark.parametrize(
    "index,values,expected",
    [
        (0, {"base_color": (0.1, 0.8, 0.8)}, {"reflectance"}),
        (0, {"diffuse_share": 0.5}, {"reflectance"}),
        (0, {"emission": (0.0, 0.5, 0.0)}, {"emission"}),
        (0, {"base_color": (0.2, 0.2, 0.2), "emission": (1.0, 0.0, 0.0)}, {"reflectance", "emission"}),
        (0, {"alpha": 0.5}, set()),  # nothing is clipped
        (2, {"alpha": 0.4}, {"shape"}),
        (2, {"alpha_threshold": 0.0}, {"shape"}),
        (1, {"base_image": 1}, {"reflectance"}),
    ],
)
def test_one_material(index, values, expected):
    changes = compare(scene(), with_material(scene(), index, **values))
    assert flags(changes) == expected
    assert changes.materials or not expected


def test_pixels_of_an_image():
    old = scene()
    for index, expected in ((0, {"reflectance"}), (1, {"shape"})):
        images = list(old.images)
        images[index] = replace(images[index], pixels=images[index].pixels * 0.5)
        changes = compare(old, replace(old, images=images))
        assert flags(changes) == expected and changes.images


def test_materials_and_images_in_another_order_look_the_same():
    old = scene()
    order = [2, 0, 1]
    materials = [old.materials[i] for i in order]
    materials = [
        replace(m, **{n: 1 - getattr(m, n) for n in ("base_image", "alpha_image") if getattr(m, n) >= 0})
        for m in materials
    ]
    new = replace(
        old,
        materials=materials,
        images=old.images[::-1],
        material_index=np.argsort(order)[old.material_index].astype(np.int32),
    )
    changes = compare(old, new)
    assert changes.nothing and changes.materials and changes.images


def test_texture_coordinates_count_where_there_is_a_texture():
    old = scene()
    for material, expected in ((0, set()), (1, {"reflectance"}), (2, {"shape"})):
        uvs = old.corner_uvs.copy()
        uvs[old.material_index == material] += 0.25
        assert flags(compare(old, replace(old, corner_uvs=uvs))) == expected


def test_another_material_on_one_triangle():
    old = scene()
    index = old.material_index.copy()
    index[np.flatnonzero(index == 0)[0]] = 1
    changes = compare(old, replace(old, material_index=index))
    assert flags(changes) == {"reflectance"} and changes.materials


def inside(points, boxes):
    """(N,) bool: is each point in one of the boxes?"""
    return ((points[:, None] >= boxes[:, 0]) & (points[:, None] <= boxes[:, 1])).all(axis=2).any(axis=1)


def test_one_object_moves():
    old = scene()
    new = with_moved(old, 2)
    changes = compare(old, new)
    assert flags(changes) == {"shape"} and changes.shape.changed == ("Chair",)
    assert changes.shape.triangle_map is None and not changes.shape.added and not changes.shape.removed
    mine = old.object_index == 2
    assert inside(old.triangle_positions[mine].reshape(-1, 3), changes.shape.old_boxes).all()
    assert inside(new.triangle_positions[mine].reshape(-1, 3), changes.shape.new_boxes).all()
    assert changes.describe() == ["1 objects changed shape or place: 'Chair'"]


def test_only_what_moved_of_an_object_is_in_the_boxes():
    old = scene()
    vertices = old.vertices.copy()
    vertices[3:6] += 5.0  # one triangle
    changes = compare(old, replace(old, vertices=vertices))
    assert changes.shape.changed == ("Floor",)
    np.testing.assert_array_equal(changes.shape.new_boxes, boxes_around(vertices[None, 3:6]))


def test_other_normals_change_the_shape():
    old = scene()
    normals = old.corner_normals.copy()
    normals[old.object_index == 1] *= -1
    assert compare(old, replace(old, corner_normals=normals)).shape.changed == ("Lamp",)


def test_objects_that_come_leave_and_change_places():
    old = scene()
    without = reordered(old, [0, 2, 3, 4])
    left = compare(old, without)
    assert flags(left) == {"shape"} and left.shape.removed == ("Lamp",) and not left.shape.changed
    assert inside(old.triangle_positions[old.object_index == 1].reshape(-1, 3), left.shape.old_boxes).all()
    assert left.shape.new_boxes.shape == (0, 2, 3)
    came = compare(without, old)
    assert came.shape.added == ("Lamp",) and not came.shape.removed and not came.shape.changed
    fresh = came.shape.triangle_map < 0
    np.testing.assert_array_equal(fresh, old.object_index == 1)
    np.testing.assert_array_equal(
        without.triangle_positions[came.shape.triangle_map[~fresh]], old.triangle_positions[~fresh]
    )


def test_objects_in_another_order_are_no_change():
    old = scene()
    new = reordered(old, [4, 1, 2, 3, 0])
    changes = compare(old, new)
    assert changes.nothing and changes.shape.only_order
    np.testing.assert_array_equal(old.triangle_positions[changes.shape.triangle_map], new.triangle_positions)


def test_instances_of_one_name_are_told_apart():
    old = scene()
    new = with_moved(reordered(old, [4, 2, 3, 0, 1]), 2)  # the second chair
    changes = compare(old, new)
    assert changes.shape.changed == ("Chair",)
    moved = changes.shape.triangle_map[new.object_index == 2]
    np.testing.assert_array_equal(np.sort(moved), np.flatnonzero(old.object_index == 3))
    assert inside(old.triangle_positions[old.object_index == 3].reshape(-1, 3), changes.shape.old_boxes).all()


def test_an_object_with_other_triangles_left_and_came():
    old = scene()
    new = reordered(replace(old, object_index=np.where(np.arange(TRIANGLES) == 0, 1, old.object_index)), range(5))
    changes = compare(old, new)
    assert changes.shape.added == changes.shape.removed == ("Floor", "Lamp")
    assert changes.shape.changed == ()


def test_a_mesh_whose_vertices_were_split_is_no_change():
    """The same corners from another vertex list."""
    old = scene()
    shared, index = np.unique(np.concatenate([old.vertices, old.vertices]), axis=0, return_inverse=True)
    new = replace(old, vertices=shared, triangles=index.reshape(-1)[: 3 * TRIANGLES].reshape(-1, 3).astype(np.int32))
    assert compare(old, new).nothing


def test_scenes_without_triangles():
    old = reordered(scene(), [])
    assert compare(old, copied(old)).nothing
    came = compare(old, scene())
    assert len(came.shape.added) == 5 and not len(came.shape.old_boxes)


@pytest.mark.parametrize("count", [1, 5, 1000])
def test_boxes_contain_all_triangles_and_stay_few(count):
    triangles = np.random.default_rng(count).normal(size=(count, 3, 3))
    boxes = boxes_around(triangles)
    assert len(boxes) == min(count, MOST_BOXES)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    within = (boxes[None, :, 0] <= low[:, None]) & (boxes[None, :, 1] >= high[:, None])
    assert within.all(axis=2).any(axis=1).all()


def test_any_set_of_changes_is_told_apart():
    """Random combinations; each kind is reported if and only if it was made."""
    generator = np.random.default_rng(3)
    makers = {
        "lights": lambda s: with_light(s, 0, color=(0.5, 0.5, 0.5)),
        "world": lambda s: replace(s, world=World((9.0, 9, 9))),
        "emission": lambda s: with_material(s, 2, emission=(3.0, 0, 0)),
        "reflectance": lambda s: with_material(s, 1, base_color=(0.1, 0.1, 0.1)),
        "shape": lambda s: with_moved(s, 4),
    }
    for _ in range(30):
        chosen = {name for name in makers if generator.random() < 0.5}
        new = scene()
        for name in chosen:
            new = makers[name](new)
        assert flags(compare(scene(), new)) == chosen


def test_shared_surfaces_are_no_change_and_lights_are_told_alike():
    """What follows lamps hands the same arrays on: the answer is that of equal ones, without looking at them."""
    before = scene()
    lights = [before.lights[0], replace(before.lights[1], color=(2.0, 1.0, 1.0))]
    after = replace(before, lights=lights, world=World((0.5, 0.5, 0.5)))
    shared, read_again = compare(before, after), compare(before, copied(after))
    assert shared.describe() == read_again.describe() and flags(shared) == flags(read_again) == {"lights", "world"}
    assert shared.lights.tolist() == read_again.lights.tolist() and shared.lights_removed == 1
    assert compare(before, replace(before)).nothing
