# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes for ``gridlight bake``, options that make it quick, and its summary."""

import bpy
from gridlight.tests.command_line import last_json

SUMMARY_KEYS = [
    "probes",
    "invalid_because",
    "iterations",
    "converged",
    "ringing",
    "seconds",
    "device",
    "settings",
    "files",
    "warnings",
]
BOX = ["--min", "-1.5,-1.5,-1.5", "--max", "1.5,1.5,1.5", "--resolution", "3,3,3"]
FAST = ["--face", "4", "--no-pictures"]


def save(path, *builders):
    """A .blend at ``path`` with what ``builders`` add to an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for build in builders:
        build()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def room(size=4.0):
    """A closed box around the origin, seen from inside."""
    bpy.ops.mesh.primitive_cube_add(size=size)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")


def lamp():
    bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
    bpy.context.object.data.energy = 50


def eevee_volume():
    bpy.ops.object.lightprobe_add(type="VOLUME")


def volume(name, location):
    def add():
        bpy.ops.object.empty_add(type="CUBE", location=location, radius=0.5)
        bpy.context.object.name = name
        bpy.context.object["gridlight_volume"] = 1
        bpy.context.object["gridlight_resolution"] = [2, 2, 2]

    return add


def summary_of(done):
    summary = last_json(done)
    assert list(summary) == SUMMARY_KEYS
    return summary
