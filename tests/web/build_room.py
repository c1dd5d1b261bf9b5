# SPDX-License-Identifier: GPL-3.0-or-later
"""Saves a small room as .blend: build_room.py FILE. Run with an environment that has Blender as a module.

Convex and empty, so that every probe sees every wall and visibility changes nothing: four coloured walls, floor,
ceiling, an area lamp and a glowing panel; a probe volume half a metre inside.
"""

import os
import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
WIDTH, DEPTH, HEIGHT = 4.0, 5.0, 3.0


def material(name, color, emission=0.0):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Specular IOR Level"].default_value = 0
    shader.inputs["Emission Color"].default_value = (1, 0.9, 0.7, 1)
    shader.inputs["Emission Strength"].default_value = emission
    return made


def wall(name, corners, made):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(made)
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


x, y, z = WIDTH / 2, DEPTH / 2, HEIGHT
wall("Floor", [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], material("Grey", (0.5, 0.5, 0.5)))
wall("Ceiling", [(-x, -y, z), (-x, y, z), (x, y, z), (x, -y, z)], material("White", (0.8, 0.8, 0.8)))
wall("East", [(x, -y, 0), (x, -y, z), (x, y, z), (x, y, 0)], material("Red", (0.8, 0.1, 0.1)))
wall("West", [(-x, -y, 0), (-x, y, 0), (-x, y, z), (-x, -y, z)], material("Green", (0.1, 0.7, 0.15)))
wall("North", [(-x, y, 0), (x, y, 0), (x, y, z), (-x, y, z)], material("Blue", (0.15, 0.2, 0.8)))
wall("South", [(-x, -y, 0), (-x, -y, z), (x, -y, z), (x, -y, 0)], material("Panel", (0.7, 0.6, 0.5), 0.6))

light = bpy.data.lights.new("Lamp", "AREA")
light.energy, light.size = 60, 1.0
lamp = bpy.data.objects.new("Lamp", light)
lamp.location = (0.4, 0.6, z - 0.05)
scene.collection.objects.link(lamp)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler = (0, -2.3, 1.5), (1.5708, 0, 0)
camera.data.lens = 18
scene.collection.objects.link(camera)
scene.camera = camera

bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])
sys.stdout.flush()
os._exit(0)  # the wheels can hang when the interpreter shuts down
