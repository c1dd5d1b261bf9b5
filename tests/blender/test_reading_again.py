# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that is read again: what is as it was is not made anew, what changed is, and warnings are repeated."""

import bpy
import numpy as np
import pytest
from gridlight.scene import images, read
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, image, material, node, place, quad, with_nodes

SURFACE = ("vertices", "triangles", "corner_normals", "corner_uvs", "material_index", "object_index")


def show(picture, name="painted", **properties):
    """A material with ``picture`` as its colour."""
    made = bpy.data.materials.new(name)
    tree = with_nodes(made)
    texture = node(tree, "ShaderNodeTexImage", image=picture, **properties)
    shader = node(tree, "ShaderNodeBsdfDiffuse", {"Color": texture.outputs["Color"]})
    node(tree, "ShaderNodeOutputMaterial", {"Surface": shader.outputs[0]})
    return made


@pytest.fixture
def scene():
    scene = empty_scene()
    noise = np.random.default_rng(2).random((8, 8, 4)).astype(np.float32)
    noise[..., 3] = 1
    picture = image("picture", noise, colorspace="sRGB", float_buffer=False)
    data = quad("floor", uv_map="UVMap")
    data.materials.append(show(picture))
    place(data, "floor")
    place(quad("wall"), "wall", location=(0, 0, 2))
    return scene


def painted(snapshot):
    (picture,) = snapshot.images
    return picture.pixels


def test_what_is_the_same_is_the_very_same(scene):
    first = read_scene(scene)
    again = read_scene(scene)
    for name in SURFACE:
        assert getattr(again, name) is getattr(first, name), name
    assert painted(again) is painted(first)


def test_pixels_are_those_that_the_image_has_now(scene):
    first = read_scene(scene)
    before = painted(first)
    kept = before.copy()
    picture = bpy.data.images["picture"]
    values = np.empty(8 * 8 * 4, np.float32)
    picture.pixels.foreach_get(values)
    values[4 * 13 + 1] = 1.0 - values[4 * 13 + 1]  # one channel of one pixel, without telling anybody
    picture.pixels.foreach_set(values)
    after = painted(read_scene(scene))
    assert after is not before and not np.array_equal(after, before)
    np.testing.assert_array_equal(before, kept)


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        ("image", "alpha_mode", "NONE"),
        ("colours", "name", "Non-Color"),
        ("node", "interpolation", "Closest"),
        ("node", "extension", "CLIP"),
    ],
)
def test_pixels_follow_how_they_are_shown(scene, owner, name, value):
    picture = bpy.data.images["picture"]
    texture = next(item for item in bpy.data.materials["painted"].node_tree.nodes if item.type == "TEX_IMAGE")
    changed = {"image": picture, "colours": picture.colorspace_settings, "node": texture}[owner]
    first = painted(read_scene(scene))
    assert getattr(changed, name) != value
    setattr(changed, name, value)
    after = read_scene(scene)
    fresh = painted(read_in_new_process_like(scene))
    np.testing.assert_array_equal(painted(after), fresh)
    same = first.shape == fresh.shape and np.array_equal(first, fresh)
    assert same == (owner == "image"), "an opaque image shows the same without alpha, and only that"


def read_in_new_process_like(scene):
    """The scene with nothing kept."""
    images._made.clear()
    read._kept_triangles.forget()
    read._kept_surface.forget()
    return read_scene(scene)


def test_pixels_go_with_the_last_who_has_them(scene):
    images._made.clear()
    first = read_scene(scene)
    assert any(kept() is painted(first) for _content, kept in images._made.values())
    del first
    assert not any(kept() is not None for _content, kept in images._made.values())


@pytest.mark.parametrize("change", ["vertex", "uv", "place", "material", "instance", "normals"])
def test_surface_follows_every_change(scene, change):
    first = read_scene(scene)
    floor, wall = bpy.data.objects["floor"], bpy.data.objects["wall"]
    if change == "vertex":
        floor.data.vertices[0].co.z += 1e-6
    elif change == "uv":
        floor.data.uv_layers[0].uv[2].vector[0] = 0.75
    elif change == "place":
        wall.location.x += 1e-6
    elif change == "material":
        wall.data.materials.append(material("grey", inputs={"Color": (0.1, 0.1, 0.1, 1)}))
    elif change == "instance":
        place(floor.data, "second floor", location=(5, 0, 0))
    else:
        wall.data.polygons[0].use_smooth = True
        floor.data.flip_normals()
    for data in (floor.data, wall.data):
        data.update()
    after = read_scene(scene)
    fresh = read_in_new_process_like(scene)
    for name in SURFACE:
        np.testing.assert_array_equal(getattr(after, name), getattr(fresh, name))
    differs = [name for name in SURFACE if not np.array_equal(getattr(first, name), getattr(after, name))]
    assert differs or change == "material" and first.materials != after.materials


def test_warnings_are_repeated(scene):
    bpy.data.images["picture"].colorspace_settings.name = "AgX Log"
    data = quad("bare")
    data.materials.append(bpy.data.materials["painted"])
    place(data, "bare", location=(9, 0, 0))
    needle = bpy.data.meshes.new("needle")
    needle.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
    place(needle, "needle")
    first, again = read_scene(scene), read_scene(scene)
    assert painted(again) is painted(first)
    assert again.warnings == first.warnings
    said = " | ".join(first.warnings)
    for words in ("colour space", "without the UV map", "without area"):
        assert words in said
