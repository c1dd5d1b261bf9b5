# SPDX-License-Identifier: GPL-3.0-or-later
"""What the reader makes of Blender's light linking."""

import bpy
import pytest
from gridlight.core.light_links import Links
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, material, place, quad


@pytest.fixture
def scene():
    return empty_scene()


def lamp(name="Lamp"):
    return place(bpy.data.lights.new(name, "POINT"), name)


def things(*names):
    return [place(quad(name)) for name in names]


def link(emitter, kind, includes=(), excludes=()):
    """A new collection that is ``kind`` of ``emitter``; members are objects or collections."""
    collection = bpy.data.collections.new(f"{emitter.name} {kind}")
    setattr(emitter.light_linking, f"{kind}_collection", collection)
    for state, members in (("INCLUDE", includes), ("EXCLUDE", excludes)):
        for member in members:
            inside = isinstance(member, bpy.types.Collection)
            (collection.children if inside else collection.objects).link(member)
            names = [one.name for one in (collection.children if inside else collection.objects)]
            links = collection.collection_children if inside else collection.collection_objects
            links[names.index(member.name)].light_linking.link_state = state
    return collection


def links_of(scene):
    """What every object of the snapshot has to do with groups, by name."""
    snapshot = read_scene(scene)
    assert snapshot.warnings == []
    rows = dict(zip(snapshot.object_index, snapshot.material_index))
    return {name: snapshot.materials[rows[index]].links for index, name in enumerate(snapshot.object_names)}


def test_included_receivers(scene):
    a, b, c = things("a", "b", "c")
    link(lamp(), "receiver", includes=[a], excludes=[b])
    lamp("Free")
    assert links_of(scene) == {"a": Links(), "b": Links(unlit_by=1), "c": Links(unlit_by=1)}
    assert {light.name: light.link_group for light in read_scene(scene).lights} == {"Lamp": 1, "Free": 0}


def test_excluded_receivers_and_blockers(scene):
    a, b, _c = things("a", "b", "c")
    one = lamp()
    link(one, "receiver", excludes=[a])
    link(one, "blocker", excludes=[b])
    assert links_of(scene) == {"a": Links(unlit_by=1), "b": Links(passed_by=1), "c": Links()}


def test_collections_inside_and_groups(scene):
    """Objects go by the collection that holds them, unless they are members themselves; lamps with the same
    collections are one group."""
    a, b, c = things("a", "b", "c")
    inside = bpy.data.collections.new("inside")
    for item in (a, b):
        inside.objects.link(item)
    first, second, third = lamp("1"), lamp("2"), lamp("3")
    second.light_linking.receiver_collection = link(first, "receiver", includes=[inside], excludes=[b])
    link(third, "receiver", includes=[c])
    groups = {light.name: light.link_group for light in read_scene(scene).lights}
    assert groups["1"] == groups["2"] != groups["3"]
    pair, alone = 1 << groups["1"] - 1, 1 << groups["3"] - 1
    assert links_of(scene) == {"a": Links(unlit_by=alone), "b": Links(unlit_by=3), "c": Links(unlit_by=pair)}


def test_glowing_objects_and_instances(scene):
    """An instance goes by the object that makes it where a collection names that one, else by the object itself."""
    a, b = things("a", "b")
    a.data.materials.append(material("glow", "ShaderNodeEmission", {"Strength": 2.0}))
    shown = bpy.data.collections.new("shown")
    shown.objects.link(b)
    named, plain = (place(None, name, instance_type="COLLECTION", instance_collection=shown) for name in "xy")
    link(a, "receiver", includes=[named])
    found = links_of(scene)
    assert found["a"] == Links(group=1, unlit_by=1)
    assert (found["x > b"], found["y > b"], found["b"]) == (Links(), Links(unlit_by=1), Links(unlit_by=1))
