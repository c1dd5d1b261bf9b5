# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry as a render sees it."""

import math
import time

import bpy
import numpy as np
import pytest
from gridlight.core.snapshot import DIFFUSE_RAYS, SHADOW_RAYS
from gridlight.scene.read import read_scene
from mathutils import Matrix
from scene_builders import empty_scene, image, material, mesh, node, place, quad, with_nodes

TRIANGLE = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]


@pytest.fixture
def scene():
    return empty_scene()


def face_normals(snapshot):
    corners = snapshot.triangle_positions
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def names(snapshot):
    return sorted(snapshot.object_names)


def test_a_triangle(scene):
    place(mesh("tri", TRIANGLE, [(0, 1, 2)]), location=(1, 2, 3))
    snapshot = read_scene(scene)
    assert np.array_equal(snapshot.triangle_positions[0], np.array(TRIANGLE) + [1, 2, 3])
    assert np.allclose(snapshot.corner_normals, [0, 0, 1])
    assert snapshot.object_names == ["tri"] and not snapshot.warnings
    assert snapshot.materials[0].base_color == pytest.approx((0.8, 0.8, 0.8))
    assert snapshot.vertices.dtype == np.float64 and snapshot.triangles.dtype == np.int32


def test_an_empty_scene_gives_empty_arrays(scene):
    snapshot = read_scene(scene)
    assert snapshot.triangles.shape == (0, 3) and snapshot.corner_uvs.shape == (0, 3, 2)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (-2, -1, 3), (-1, -1, -1), (1, 5, 0.01)])
def test_scale_and_mirroring_keep_fronts_and_normals(scene, scale):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=1)
    ball = bpy.context.object
    ball.data.shade_smooth()
    ball.scale = scale
    ball.rotation_euler = (0.3, 0.7, -0.4)
    snapshot = read_scene(scene)
    outwards = snapshot.triangle_positions.mean(axis=1)
    assert (np.einsum("ti,ti->t", face_normals(snapshot), outwards) > 0).all()
    # An ellipsoid's normal is the gradient of its quadric.
    matrix = np.array(ball.matrix_world)[:3, :3]
    quadric = np.linalg.inv(matrix @ matrix.T)
    expected = snapshot.triangle_positions @ quadric
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    assert np.allclose(np.linalg.norm(snapshot.corner_normals, axis=-1), 1, atol=1e-5)
    assert (np.einsum("tci,tci->tc", snapshot.corner_normals, expected) > 0.98).all()


def test_shear_through_a_parent(scene):
    parent = place(None, "parent", scale=(1, 1, 3))
    child = place(quad(), parent=parent, rotation_euler=(math.radians(45), 0, 0))
    snapshot = read_scene(scene)
    matrix = np.array(child.matrix_world)
    expected = np.linalg.inv(matrix[:3, :3]).T @ [0, 0, 1]
    assert np.allclose(face_normals(snapshot), expected / np.linalg.norm(expected), atol=1e-6)
    assert np.allclose(snapshot.corner_normals, expected / np.linalg.norm(expected), atol=1e-6)


def test_flattened_objects_keep_their_visible_faces(scene):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.scale = (1, 1, 0)
    snapshot = read_scene(scene)
    assert np.isfinite(snapshot.corner_normals).all()
    assert np.allclose(np.abs(snapshot.corner_normals[..., 2]), 1)


def test_far_from_the_origin_small_details_survive(scene):
    place(mesh("tri", TRIANGLE, [(0, 1, 2)]), location=(2.0**20, 0, 0), scale=(0.001,) * 3)
    corners = read_scene(scene).triangle_positions[0]
    assert np.allclose(corners[1] - corners[0], [0.001, 0, 0], atol=1e-9)


def test_visibility_is_the_renders(scene):
    data = mesh("tri", TRIANGLE, [(0, 1, 2)])
    place(data, "shown")
    place(data, "no render", hide_render=True)
    place(data, "no viewport", hide_viewport=True)
    place(data, "eye closed").hide_set(True)
    for name, render, viewport in (("render off", True, False), ("viewport off", False, True)):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        collection.hide_render, collection.hide_viewport = render, viewport
        place(data, f"in {name}", collection)
    excluded = bpy.data.collections.new("excluded")
    scene.collection.children.link(excluded)
    place(data, "in excluded", excluded)
    scene.view_layers[0].layer_collection.children["excluded"].exclude = True
    light = place(bpy.data.lights.new("lamp", "POINT"), "hidden lamp", hide_render=True)
    assert names(read_scene(scene)) == ["eye closed", "in viewport off", "no viewport", "shown"]
    assert read_scene(scene).lights == []
    assert names(read_scene(scene, live=True)) == ["shown"]
    light.hide_render = False
    assert [item.name for item in read_scene(scene).lights] == ["hidden lamp"]


def test_modifiers_at_render_level(scene):
    bpy.ops.mesh.primitive_cube_add()
    subdivision = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 2
    assert len(read_scene(scene).triangles) == 6 * 16 * 2
    assert len(read_scene(scene, live=True).triangles) == 6 * 2


def test_curves_text_surfaces_and_metaballs(scene):
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "A"
    place(text, "text")
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    curve.splines.new("POLY").points.add(1)
    curve.splines[0].points[1].co = (1, 0, 0, 1)
    place(curve, "curve")
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    place(ball, "ball")
    bpy.ops.surface.primitive_nurbs_surface_torus_add()
    snapshot = read_scene(scene)
    assert {name.split(" > ")[0] for name in snapshot.object_names} == {
        "text",
        "curve",
        "ball",
        bpy.context.object.name,
    }
    assert all((snapshot.object_index == index).any() for index in range(4))
    assert not snapshot.warnings


def test_instances_of_collections_and_their_lights(scene):
    inner = bpy.data.collections.new("inner")
    place(mesh("tri", TRIANGLE, [(0, 1, 2)]), "part", inner, location=(0, 0, 1))
    place(bpy.data.lights.new("lamp", "POINT"), "lamp", inner)
    for x in (0, 5):
        place(None, f"copy {x}", instance_type="COLLECTION", instance_collection=inner, location=(x, 0, 0))
    snapshot = read_scene(scene)
    assert np.allclose(sorted(snapshot.triangle_positions[:, 0].tolist()), [[0, 0, 1], [5, 0, 1]])
    assert sorted(light.matrix[0, 3] for light in snapshot.lights) == [0, 5]
    assert names(snapshot) == ["copy 0 > part", "copy 5 > part"]


def test_geometry_nodes_instances_and_materials(scene):
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes = tree.nodes
    grid, cube, scatter, paint, exit_node = (
        nodes.new(kind)
        for kind in (
            "GeometryNodeMeshGrid",
            "GeometryNodeMeshCube",
            "GeometryNodeInstanceOnPoints",
            "GeometryNodeSetMaterial",
            "NodeGroupOutput",
        )
    )
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = 3
    paint.inputs["Material"].default_value = material("red", inputs={"Color": (1, 0, 0, 1)})
    for source, target in (
        (grid.outputs["Mesh"], scatter.inputs["Points"]),
        (cube.outputs["Mesh"], paint.inputs["Geometry"]),
        (paint.outputs["Geometry"], scatter.inputs["Instance"]),
        (scatter.outputs["Instances"], exit_node.inputs[0]),
    ):
        tree.links.new(source, target)
    place(quad(), "scattered").modifiers.new("nodes", "NODES").node_group = tree
    snapshot = read_scene(scene)
    assert len(snapshot.triangles) == 9 * 12
    used = {snapshot.materials[index].name for index in np.unique(snapshot.material_index)}
    assert used == {"red"}


def test_particles(scene):
    item = place(mesh("tri", TRIANGLE, [(0, 1, 2)]), "leaf", location=(0, 0, -50))
    emitter = place(quad(), "emitter")
    emitter.modifiers.new("particles", "PARTICLE_SYSTEM")
    settings = emitter.particle_systems[0].settings
    settings.type, settings.count, settings.render_type, settings.instance_object = "HAIR", 7, "OBJECT", item
    settings.use_advanced_hair = True
    assert sum(name == "emitter > leaf" for name in read_scene(scene).object_names) == 7
    settings.render_type = "PATH"
    assert any("particle hair" in line and "emitter" in line for line in read_scene(scene).warnings)


def test_slots_linked_to_object_or_data(scene):
    red, blue = material("red"), material("blue")
    data = mesh("two", [*TRIANGLE, (1, 1, 0)], [(0, 1, 2), (1, 3, 2)])
    data.materials.append(red)
    data.materials.append(None)
    data.polygons[1].material_index = 1
    item = place(data, "a")
    item.material_slots[1].link, item.material_slots[1].material = "OBJECT", blue
    snapshot = read_scene(scene)
    assert [snapshot.materials[index].name for index in snapshot.material_index] == ["red", "blue"]
    scene.view_layers[0].material_override = blue
    snapshot = read_scene(scene)
    assert [snapshot.materials[index].name for index in snapshot.material_index] == ["blue", "blue"]


def test_uv_maps_with_mapping_and_mirroring(scene):
    item = place(quad(uv_map="UVMap"), "plain")
    made = bpy.data.materials.new("textured")
    tree = with_nodes(made)
    coordinates = node(tree, "ShaderNodeTexCoord")
    mapping = node(
        tree,
        "ShaderNodeMapping",
        {
            "Vector": coordinates.outputs["UV"],
            "Location": (0.5, 0, 0),
            "Rotation": (0, 0, math.pi / 2),
            "Scale": (2, 3, 1),
        },
    )
    texture = node(tree, "ShaderNodeTexImage", {"Vector": mapping.outputs[0]}, image=image("i", np.ones((4, 4, 4))))
    shader = node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs["Color"]})
    node(tree, "ShaderNodeOutputMaterial", {"Surface": shader.outputs[0]})
    item.data.materials.append(made)
    for scale in ((1, 1, 1), (-1, 1, 1)):
        item.scale = scale
        snapshot = read_scene(scene)
        u, v = np.moveaxis(snapshot.triangle_positions[..., :2] * [scale[0], 1] * 0.5 + 0.5, -1, 0)
        expected = np.stack([0.5 - 3 * v, 2 * u], axis=-1)  # scaled, turned by 90°, moved
        assert np.allclose(snapshot.corner_uvs, expected, atol=1e-6)


def test_broken_triangles_are_dropped_and_named(scene):
    data = mesh("broken", [*TRIANGLE, (2, 2, 2), (0.5, 0.5, 0)], [(0, 1, 2), (0, 1, 3), (1, 4, 2)])
    data.vertices[3].co = (math.nan, 0, math.inf)
    place(data, "Broken Chair")
    snapshot = read_scene(scene)
    assert len(snapshot.triangles) == 1 and np.isfinite(snapshot.vertices).all()
    assert any("Broken Chair" in line and "1 triangles have corners" in line for line in snapshot.warnings)
    assert any("Broken Chair" in line and "without area" in line for line in snapshot.warnings)


def test_what_has_no_surface_is_named(scene):
    place(bpy.data.volumes.new("v"), "Smoke")
    place(bpy.data.pointclouds.new("p"), "Scan")
    place(bpy.data.hair_curves.new("h"), "Fur")
    warnings = "\n".join(read_scene(scene).warnings)
    assert all(name in warnings for name in ("Smoke", "Scan", "Fur"))


def test_ray_visibility(scene):
    place(quad(), "reflection card", visible_diffuse=False, visible_shadow=False)
    glow = material("glow", "ShaderNodeEmission")
    for name, rays in (
        ("both", {}),
        ("no bounce", {"visible_diffuse": False}),
        ("no shadow", {"visible_shadow": False}),
    ):
        place(quad(), name, **rays).data.materials.append(glow)
    snapshot = read_scene(scene)
    assert snapshot.object_names == ["both", "no bounce", "no shadow"] and not snapshot.warnings
    rows = [snapshot.materials[index] for index in snapshot.material_index[::2]]
    assert [row.unseen_by for row in rows] == [0, DIFFUSE_RAYS, SHADOW_RAYS]
    assert [any(row.emission) for row in rows] == [True, False, True], "what no diffuse ray meets lights nothing"


def test_a_mesh_that_is_being_edited_is_read_as_it_is_now(scene):
    """With its modifiers, by render and viewport alike; other users of the mesh follow too."""
    bpy.ops.mesh.primitive_cube_add(size=2)
    cube = bpy.context.object
    place(cube.data, "linked", location=(5, 0, 0))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(1, 1, 3))
    for live in (True, False):  # a render's reading brings the datablock up to date
        snapshot = read_scene(scene, live=live)
        assert len(snapshot.triangles) == 24 and snapshot.vertices[:, 2].max() == pytest.approx(3)
    subdivision = cube.modifiers.new("Subdivision", "SUBSURF")
    subdivision.subdivision_type, subdivision.levels, subdivision.render_levels = "SIMPLE", 1, 2
    bpy.context.view_layer.update()
    assert len(read_scene(scene, live=True).triangles) == 12 * 4 + 12
    assert len(read_scene(scene).triangles) == 12 * 16 + 12
    bpy.ops.object.mode_set(mode="OBJECT")
    assert len(read_scene(scene, live=True).triangles) == 12 * 4 + 12


def test_one_mesh_read_once_for_a_thousand_instances(scene, monkeypatch):
    from gridlight.scene import read

    calls = []
    monkeypatch.setattr(
        read, "copy_mesh", lambda *arguments, original=read.copy_mesh: calls.append(1) or original(*arguments)
    )
    data = mesh("tri", TRIANGLE, [(0, 1, 2)])
    for index in range(1000):
        place(data, location=(index, 0, 0), scale=(1, 1, -1 if index % 2 else 1))
    snapshot = read_scene(scene)
    assert len(calls) == 1 and len(snapshot.triangles) == 1000
    # A mirrored object's front is the mirror image of its front, although these vertices stay where they are.
    assert np.array_equal(face_normals(snapshot)[:, 2], np.tile([1, -1], 500))


def test_frames_leave_the_scene_where_it_was(scene):
    item = place(mesh("tri", TRIANGLE, [(0, 1, 2)]), "moving")
    item.keyframe_insert("location", frame=1)
    item.location = (9, 0, 0)
    item.keyframe_insert("location", frame=10)
    scene.frame_set(1)
    snapshot = read_scene(scene, frame=10)
    assert snapshot.triangle_positions[0, 0, 0] == pytest.approx(9)
    assert snapshot.frame == 10 and scene.frame_current == 1


def test_rigid_bodies_are_where_their_simulation_took_them(scene):
    bpy.ops.mesh.primitive_cube_add()
    item = bpy.context.object
    bpy.ops.rigidbody.world_add()
    bpy.ops.rigidbody.object_add()
    for frame in range(1, 11):
        scene.frame_set(frame)
    fallen = item.matrix_world.translation.z
    assert fallen < -0.5
    assert read_scene(scene).vertices[:, 2].mean() == pytest.approx(fallen, abs=1e-5)


def test_reading_leaves_nothing_behind(scene):
    place(quad())
    before = {
        name: len(getattr(bpy.data, name)) for name in ("scenes", "objects", "cameras", "images", "meshes", "worlds")
    }
    engine = scene.render.engine
    read_scene(scene)
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert scene.render.engine == engine and scene.camera is None
    assert not hasattr(bpy.types, "GRIDLIGHT_SCENE_READER")


def test_a_million_triangles_within_three_seconds(scene):
    edge = 708
    x, y = np.meshgrid(np.linspace(-1, 1, edge + 1), np.linspace(-1, 1, edge + 1))
    vertices = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], -1).reshape(-1, 3).astype(np.float32)
    first = np.arange(edge * (edge + 1)).reshape(edge, edge + 1)[:, :-1].ravel()
    faces = np.stack([first, first + 1, first + edge + 2, first + edge + 1], axis=1).astype(np.int32)
    data = bpy.data.meshes.new("grid")
    data.vertices.add(len(vertices))
    data.vertices.foreach_set("co", vertices.ravel())
    data.loops.add(faces.size)
    data.loops.foreach_set("vertex_index", faces.ravel())
    data.polygons.add(len(faces))
    data.polygons.foreach_set("loop_start", np.arange(0, faces.size, 4, dtype=np.int32))
    data.update(calc_edges=True)
    data.uv_layers.new(name="UVMap")
    data.shade_smooth()
    sharp = data.attributes.new("sharp_face", "BOOLEAN", "FACE")
    sharp.data.foreach_set("value", np.arange(len(faces)) % 2 == 0)
    data.update()
    place(data, "grid")
    seconds = np.inf
    for _ in range(3):  # the machine may be busy with something else for a moment
        started = time.process_time()
        snapshot = read_scene(scene)
        seconds = min(seconds, time.process_time() - started)
    print(f"{len(snapshot.triangles)} triangles with corner normals in {seconds:.2f} s")
    assert len(snapshot.triangles) >= 1_000_000
    assert seconds < 3


def test_matrix_of_the_instance_counts_not_the_objects(scene):
    inner = bpy.data.collections.new("inner")
    place(mesh("tri", TRIANGLE, [(0, 1, 2)]), "part", inner)
    turned = Matrix.Rotation(math.pi / 2, 4, "Z")
    place(None, "copy", instance_type="COLLECTION", instance_collection=inner, matrix_world=turned)
    corners = read_scene(scene).triangle_positions[0]
    assert np.allclose(corners[1], [0, 1, 0], atol=1e-6)
