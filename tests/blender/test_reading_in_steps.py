# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading beside a living window: the same scene as at once, no step that computes triangles, edits in between."""

import time

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.core.steps import run, together
from gridlight.operators import stale
from gridlight.operators.bake_task import BakeTask
from gridlight.scene import read
from gridlight.scene.field_storage import stored_details
from gridlight.scene.geometry import copy_mesh, triangulated
from gridlight.scene.read import read_in_steps, read_scene
from gridlight.scene.volumes import create_volume
from scene_builders import empty_scene, image, material, mesh, node, place


@pytest.fixture
def scene():
    return empty_scene()


def crumpled(name: str, faces, seed: int = 1):
    """A mesh whose faces have random corners, so that many quads are bent, notched or folded over."""
    corners = 1 + max(max(face) for face in faces)
    return mesh(name, np.random.default_rng(seed).uniform(-1, 1, (corners, 3)).tolist(), faces)


def faces_of_sizes(sizes):
    ends = np.cumsum(sizes)
    return [tuple(range(end - size, end)) for size, end in zip(sizes, ends)]


@pytest.mark.parametrize("sizes", [(4,), (3, 4), (4, 3, 4, 4), (3, 4, 5, 4)], ids=str)
def test_faces_are_split_where_blender_splits_them(scene, sizes):
    data = crumpled("faces", faces_of_sizes(list(sizes) * 100))
    own = triangulated(copy_mesh(data)).triangles
    data.calc_loop_triangles()
    assert np.array_equal(own, [triangle.vertices[:] for triangle in data.loop_triangles])
    if sizes == (4,):
        other = (own.reshape(-1, 2, 3)[:, 0] - 4 * np.arange(100)[:, None] == [0, 1, 3]).all(axis=1)
        assert 20 < other.sum() < 80, "both ways to split a quad occur"


def patterned(scene):
    """Two meshes with several materials, one of them with an image on a UV map, one instanced and mirrored."""
    textured = material("Textured")
    dots = image("Dots", np.random.default_rng(2).random((4, 4, 4)))
    texture = node(textured.node_tree, "ShaderNodeTexImage", image=dots)
    shader = next(item for item in textured.node_tree.nodes if item.type == "BSDF_DIFFUSE")
    textured.node_tree.links.new(texture.outputs["Color"], shader.inputs["Color"])
    bpy.ops.mesh.primitive_monkey_add()
    monkey = bpy.context.object
    for chosen in (textured, material("Plain"), None):
        monkey.data.materials.append(chosen)
    monkey.data.polygons.foreach_set("material_index", np.arange(len(monkey.data.polygons), dtype=np.int32) % 3)
    place(monkey.data, location=(3, 0, 0)).scale.x = -1
    place(crumpled("faces", faces_of_sizes([3, 4, 5, 4])), location=(0, 3, 0))
    scene.view_layers[0].update()


def test_steps_read_what_is_read_at_once(scene):
    patterned(scene)
    at_once = [read_scene(scene), read_scene(scene, live=True)]
    in_steps = run(together(read_in_steps(scene), read_in_steps(scene, live=True)))
    for one, other in zip(at_once, in_steps):
        for name, value in vars(one).items():
            if isinstance(value, np.ndarray):
                assert np.array_equal(value, getattr(other, name)), name
        assert one.object_names == other.object_names and one.warnings == other.warnings
        assert [item.name for item in one.materials] == [item.name for item in other.materials]


def _forget():
    """What earlier readings found out about the same triangles."""
    read._kept_triangles.forget()
    read._kept_surface.forget()


def test_no_step_computes_triangles(scene):
    """In processor time of the thread that Blender's window waits for."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=250, y_subdivisions=250)
    scene.view_layers[0].update()
    run(read_in_steps(scene))
    _forget()
    began = time.thread_time()
    read_scene(scene)
    at_once = time.thread_time() - began
    _forget()
    longest, steps = 0.0, read_in_steps(scene)
    while True:
        began = time.thread_time()
        try:
            next(steps)
        except StopIteration:
            break
        finally:
            longest = max(longest, time.thread_time() - began)
    assert longest < 0.4 * at_once, (longest, at_once)


@pytest.fixture
def room(scene):
    """A cube with a lamp in it and a volume of 2×2×2."""
    gridlight.register()
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.3, 1.0))
    volume = create_volume(scene, "Room", np.diag([1.0, 1.0, 1.0, 1.0]), (2, 2, 2))
    scene.gridlight.face = 8
    scene.view_layers[0].update()
    yield volume
    gridlight.unregister()


@pytest.mark.parametrize("edited", [False, True])
def test_light_is_not_called_up_to_date_when_the_scene_was_edited_while_it_was_read(scene, room, gpu_context, edited):
    task = BakeTask(scene, scene.view_layers[0], [room])
    lamp = bpy.data.objects["Point"]
    for step, _ in enumerate(task):
        if edited and step == 1:  # the scene was read as the viewport shows it, but not yet as renders do
            assert task.progress.phase_name == "read"
            lamp.location.x -= 1.0
        scene.view_layers[0].update()  # as Blender does between two steps
    assert bool(stored_details(room)["viewport_hashes"]) is not edited
    stale.compare(scene, scene.view_layers[0])
    assert stale.state_of(scene, room) == (stale.STALE if edited else stale.FRESH)


def test_light_is_up_to_date_after_animation_has_overruled_a_change_by_hand(scene, room, gpu_context):
    lamp = bpy.data.objects["Point"]
    lamp.keyframe_insert("location", frame=1)
    lamp.data.keyframe_insert("energy", frame=1)
    scene.view_layers[0].update()
    lamp.location.x -= 1.0
    lamp.data.energy *= 2.0
    task = BakeTask(scene, scene.view_layers[0], [room])
    for _ in task:
        scene.view_layers[0].update()  # as Blender does between two steps
    assert any("'Point' is animated and was changed by hand" in line for line in task.progress.warnings)
    assert stored_details(room)["viewport_hashes"]
    stale.compare(scene, scene.view_layers[0])
    assert stale.state_of(scene, room) == stale.FRESH
