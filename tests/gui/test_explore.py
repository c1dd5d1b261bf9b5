# SPDX-License-Identifier: GPL-3.0-or-later
"""Explore mode: every key of the sample, pressed by a person."""

import os
import shutil
from pathlib import Path

import bpy
import lit_room
import numpy as np
from harness import in_blender


def enter(person):
    assert person.do("gridlight.explore", invoke=True) == {"RUNNING_MODAL"}
    yield 0.3
    return person.module("operators.explore")._running[0]


def lamp_of_group(group, location):
    bpy.ops.object.light_add(type="POINT", location=location)
    lamp = bpy.context.object
    lamp.data.energy = 30
    lamp.gridlight_light.group = group
    return lamp


@in_blender()
def test_walking_looking_and_help(person):
    lit_room.build(person, lamp=True)
    bpy.data.objects["Light"].location = (1, 1, 2)
    space = lit_room.view(person, distance=1.0)
    region_3d = space.region_3d
    explore = yield from enter(person)
    assert bpy.context.scene.gridlight.preview.enabled
    yield from lit_room.drawn(person)
    eye = explore._walker.eye.copy()
    yield from person.hold("w", 0.6)
    walked = explore._walker.eye - eye
    assert walked.length > 0.05 and abs(walked.z) < 1e-6, walked
    ahead = np.array((-np.sin(explore._walker.heading), np.cos(explore._walker.heading), 0))
    assert np.dot(np.array(walked) / walked.length, ahead) > 0.999
    assert np.allclose(region_3d.view_matrix.inverted().translation, explore._walker.eye, atol=1e-4)
    eye = explore._walker.eye.copy()
    yield from person.hold("Left", 0.4)
    aside = np.array(explore._walker.eye - eye)
    assert np.linalg.norm(aside) > 0.05 and abs(np.dot(aside, ahead)) < 1e-6
    heading = explore._walker.heading
    x, y = person.rectangle().center
    for step in range(1, 6):
        person.move(x + 20 * step, y)
        yield 0.1
    assert abs(explore._walker.heading - heading) > 0.02
    yield from person.key("F1")
    yield 0.5
    person.picture("help")
    assert person.find("screenshot to a file", person.rectangle())
    yield from person.key("F1", "space")
    yield 0.5
    assert bpy.context.scene.gridlight.preview.show_rate
    yield from person.key("space", "Escape")
    assert not person.module("operators.explore")._running
    assert not bpy.context.scene.gridlight.preview.enabled


@in_blender(backends=("opengl",))
def test_lights_walls_animation_exposure_probes_and_screenshots(person):
    lit_room.build(person)
    lamps = {
        group: lamp_of_group(group, (index - 1.5, 0.5, 1.0))
        for index, group in enumerate(("CEILING_1", "CEILING_2", "DYNAMIC"))
    }
    bpy.ops.mesh.primitive_cube_add(size=0.4, location=(1, 1, 1))
    glowing = lamps["WALL"] = bpy.context.object
    glowing.gridlight_light.group = "WALL"
    mover, still = lamps["DYNAMIC"], lamps["CEILING_1"]
    for item in (mover, still):
        item.keyframe_insert("location", frame=1)
        item.location.x += 1
        item.keyframe_insert("location", frame=20)
    still.gridlight_light.animate = False
    bpy.context.scene.frame_set(1)
    still_x = still.location.x
    scene, preview = bpy.context.scene, bpy.context.scene.gridlight.preview
    explore = yield from enter(person)
    yield from lit_room.drawn(person)
    keys = {"CEILING_1": ("1", "2"), "CEILING_2": ("3", "4"), "WALL": ("5", "6"), "DYNAMIC": ("7", "8")}
    for group, (down, up) in keys.items():
        light = lamps[group].gridlight_light
        yield from person.key(up)
        assert abs(light.intensity - 2**0.5) < 1e-3, (group, light.intensity)
        yield from person.key(down, down)
        assert abs(light.intensity - 2**-0.5) < 1e-3, (group, light.intensity)
    person.picture("groups")
    socket = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    before = tuple(socket.default_value)
    yield from person.key("plus")
    first = tuple(socket.default_value)
    assert first != before
    yield from person.key("plus")
    second = tuple(socket.default_value)
    yield from person.key("minus")
    assert second != first and tuple(socket.default_value) == first
    yield from person.key("Prior")
    assert preview.exposure == 0.25
    yield from person.key("Next", "Next")
    assert preview.exposure == -0.25
    yield from person.key("p")
    assert preview.show_probes
    yield from lit_room.drawn(person)
    person.picture("probes")
    folder = Path(person.module("operators.explore_actions").screenshot_path()).parent
    before = set(folder.glob("*.png"))
    yield from person.key("F9")
    yield 1.0
    shots = set(folder.glob("*.png")) - before
    assert len(shots) == 1
    shot = bpy.data.images.load(str(shots.pop()))
    assert shot.size[0] >= person.rectangle().width // 2 and np.std(shot.pixels[:]) > 0.01
    os.remove(shot.filepath)
    bpy.data.images.remove(shot)
    yield from person.key("9")
    yield from person.wait_until(lambda: scene.frame_current > 3, "playback", 20.0)
    assert abs(still.location.x - still_x) < 1e-4 and mover.location.x != 0
    yield from person.key("9")
    assert not bpy.context.screen.is_animation_playing
    assert explore._overlay._text == "Animation off"
    yield from person.key("Escape")
    assert scene.frame_current == 1 and still.animation_data.action is not None
    preview.show_probes = False


@in_blender(backends=("opengl",))
def test_a_screenshot_that_cannot_be_written_is_told_and_the_walk_goes_on(person):
    lit_room.build(person)
    folder = Path(bpy.app.tempdir) / "gone"
    folder.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "walk.blend"))
    shutil.rmtree(folder)
    folder.touch()  # a folder that is merely gone would be made again
    explore = yield from enter(person)
    yield from person.key("F9")
    yield 0.5
    said = explore._overlay._text
    assert said == f"Cannot write {folder / 'walk_0001.png'}; save the file elsewhere", said
    eye = explore._walker.eye.copy()
    yield from person.hold("w", 0.4)
    assert (explore._walker.eye - eye).length > 0.01
    yield from person.key("Escape")
    assert not person.module("operators.explore")._running


@in_blender(backends=("opengl",))
def test_ending_in_the_middle(person):
    """A file that is loaded, or a switched-off add-on, ends Explore mode without a trace."""
    lit_room.build(person)
    yield from enter(person)
    person.module("operators.explore").stop_running()
    yield 0.3
    assert not bpy.context.scene.gridlight.preview.enabled
    yield from enter(person)
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.5
    assert not person.module("operators.explore")._running
