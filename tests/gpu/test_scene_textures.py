# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes on the GPU: what cannot be numbered is refused; what is brought up to date is what a fresh scene would be."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core import scene_changes
from gridlight.core.errors import InputError
from gridlight.core.snapshot import Image
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.gpu_shaders.textures import read
from small_scenes import box, cluttered_room, frame, snapshot_of

ORIGIN = np.array([0.1, 0.2, -0.1])


def test_too_many_triangles_are_refused_in_one_line():
    count = (1 << 24) + 1
    huge = replace(snapshot_of(box()), triangles=np.broadcast_to(np.int32(0), (count, 3)), name="Forest")
    with pytest.raises(InputError, match=r"'Forest' has 16777217 triangles, 16777216 is the most; hide"):
        SceneTextures(huge, np.zeros(3), np.zeros(count))


def test_a_growing_scene_needs_few_shaders():
    """Each size of the stack is a set of programs, which stay for the session and take seconds to compile."""
    generator = np.random.default_rng(3)
    needed, given = [], []
    for count in (1, 3, 10, 30, 100, 300):
        boxes = [box(place, place + 0.1) for place in generator.uniform(-1, 1, (count, 3))]
        snapshot = snapshot_of(np.concatenate(boxes))
        scene = SceneTextures(snapshot, np.zeros(3), np.zeros(len(snapshot.triangles)))
        needed.append(scene.hierarchy.stack_size)
        given.append(scene.ray_defines["STACK_SIZE"])
    assert all(size >= least for size, least in zip(given, needed, strict=True))
    assert len(set(needed)) > 3 and len(set(given)) <= 3, (needed, given)


def density(snapshot):
    """Some emitters, whose density depends on all of them."""
    values = np.where(snapshot.material_index == 3, 1.0 + snapshot.material_index % 2, 0.0)
    area = np.linalg.norm(snapshot.triangle_positions[:, 1] - snapshot.triangle_positions[:, 0], axis=1)
    return values / (values * area).sum()


def contents(scene, snapshot):
    """All textures as arrays, triangles as the snapshot counts them."""
    count = scene.triangle_count
    place = np.empty(count, int)
    place[scene.hierarchy.order] = np.arange(count)
    sizes = {"materials": 3 * len(snapshot.materials), "emitters": scene.emitter_count, "lights": 6 * scene.light_count}
    result = {name: read(scene._textures[name], size) for name, size in sizes.items()}
    result["emitters"][:, 0] = scene.hierarchy.order[result["emitters"][:, 0].astype(int)]
    for name, width in (("triangle_corners", 3), ("triangle_attributes", 5)):
        result[name] = read(scene._textures[name], count * width).reshape(count, width, 4)[place]
    result["triangle_corners"][:, 0, 3] = 0  # where leaves end
    if scene.has_images:
        result["image_table"] = read(scene._textures["image_table"], len(snapshot.images))
        result["image_texels"] = read(scene._textures["image_texels"], 4096)
    return result | {"emitter_reach": scene.emitter_reach, "defines": list(scene.light_defines.items())[:2]}


def moved(snapshot, which, offset):
    vertices = snapshot.vertices.copy()
    vertices[snapshot.triangles[which].ravel()] += offset
    return replace(snapshot, vertices=vertices)


def other_material(snapshot, index, **values):
    materials = list(snapshot.materials)
    materials[index] = replace(materials[index], **values)
    return replace(snapshot, materials=materials)


def without(snapshot, which):
    keep = ~which
    return replace(
        snapshot,
        **{
            name: getattr(snapshot, name)[keep]
            for name in ("triangles", "corner_normals", "corner_uvs", "material_index", "object_index")
        },
    )


def scrambled(snapshot):
    return replace(snapshot, vertices=np.random.default_rng(5).uniform(-1, 1, snapshot.vertices.shape))


CHANGES = {
    "nothing": (lambda s: replace(s, name="again"), "kept"),
    "a light": (lambda s: replace(s, lights=[replace(s.lights[0], matrix=frame((0, 0, 0.2))), *s.lights[1:]]), "kept"),
    "fewer lights": (lambda s: replace(s, lights=s.lights[:2]), "kept"),
    "a colour": (lambda s: other_material(s, 0, base_color=(0.1, 0.2, 0.3)), "kept"),
    "emission": (lambda s: other_material(s, 2, emission=(5.0, 0, 0)), "kept"),
    "an image": (
        lambda s: replace(s, images=[Image("b", s.images[0].pixels[::-1].copy()), *s.images[1:]]),
        "refit",
    ),  # also a net's
    "no images": (
        lambda s: replace(
            s, images=[], materials=[replace(m, base_image=-1, emission_image=-1, alpha_image=-1) for m in s.materials]
        ),
        "refit",  # holes come and go
    ),
    "an object moves": (lambda s: moved(s, s.object_index == 2, (0.2, 0.1, 0.0)), "refit"),
    "an emitter moves": (lambda s: moved(s, s.material_index == 3, (0.0, 0.05, 0.0)), "refit"),
    "everything moves": (lambda s: moved(s, s.object_index >= 0, (0.0, 0.5, 0.0)), "refit"),
    "everything is thrown about": (scrambled, "rebuilt"),
    "an object leaves": (lambda s: without(s, s.object_index == 3), "rebuilt"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_an_updated_scene_is_what_a_fresh_one_would_be(name):
    change, hierarchy = CHANGES[name]
    old = cluttered_room(clutter=400)
    new = change(old)
    scene = SceneTextures(old, ORIGIN, density(old))
    assert scene.update(new, scene_changes.compare(old, new), density(new)) == hierarchy
    expected = contents(SceneTextures(new, ORIGIN, density(new)), new)
    found = contents(scene, new)
    assert found.keys() == expected.keys()
    for key, value in expected.items():
        np.testing.assert_array_equal(found[key], value, err_msg=key)
    nodes = scene.hierarchy.nodes.reshape(-1, 4)
    np.testing.assert_array_equal(read(scene._textures["bvh_nodes"], len(nodes)), nodes)


def test_updates_follow_each_other():
    """There and back again leaves what was there first."""
    first = cluttered_room(clutter=100)
    second = moved(first, first.object_index == 1, (0.3, 0.0, 0.1))
    scene = SceneTextures(first, ORIGIN, density(first))
    before = contents(scene, first)
    for old, new in ((first, second), (second, first)):
        assert scene.update(new, scene_changes.compare(old, new), density(new)) == "refit"
    after = contents(scene, first)
    for key, value in before.items():
        np.testing.assert_array_equal(after[key], value, err_msg=key)
