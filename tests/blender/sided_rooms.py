# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed rooms whose materials look different from behind or to shadow rays, each with a grid to be baked in it."""

import bpy
from gridlight.core.grid import Grid
from gridlight.tests import scenes
from scene_builders import node, with_nodes

SIZE = (3.0, 3.0, 2.6)
RED, BLUE, GREY = (0.7, 0.2, 0.1, 1), (0.1, 0.2, 0.6, 1), (0.5, 0.5, 0.5, 1)


def mixed(output, first, second, name="Mixed"):
    """A material that is ``first`` where an ``output`` of Geometry or Light Path is 0, else ``second``."""
    made = bpy.data.materials.new(name)
    tree = with_nodes(made)
    kind = "ShaderNodeNewGeometry" if output == "Backfacing" else "ShaderNodeLightPath"
    factor = node(tree, kind).outputs[output]
    one, other = (node(tree, kind, inputs).outputs[0] for kind, inputs in (first, second))
    whole = node(tree, "ShaderNodeMixShader", {"Fac": factor, "Shader": one, "Shader_001": other})
    node(tree, "ShaderNodeOutputMaterial", {"Surface": whole.outputs[0]})
    return made


def diffuse(color):
    return "ShaderNodeBsdfDiffuse", {"Color": color}


def glow(color, strength):
    return "ShaderNodeEmission", {"Color": color, "Strength": strength}


def clear(color=(1, 1, 1, 1)):
    return "ShaderNodeBsdfTransparent", {"Color": color}


def room(name):
    scene = scenes.new_scene(name)
    walls = [scenes.diffuse(color) for color in ((0.5, 0.45, 0.4), (0.75,) * 3, *[(0.65, 0.65, 0.6)] * 4)]
    scenes.add_room_slabs(scene, (0, 0, 0), SIZE, 0.2, walls)
    scenes.add_box(scene, "Box", (0.4, 1.6, 0), (1.1, 2.4, 0.9), scenes.diffuse((0.3, 0.5, 0.3)), 0.3)
    return scene


def shade(scene, height, half, material, turn=1):
    """A square that faces down, or up with a ``turn`` of −1."""
    return scenes.add_plane(scene, "Shade", (1.5, 1.4, height), (half, 0, 0), (0, -half * turn, 0), material)


def lit(scene):
    scenes.add_light(scene, "POINT", (1.5, 1.5, 2.35), energy=80.0, shadow_soft_size=0.0)
    return scene


def _one_sided(half, height, back, turn=1):
    def make():
        scene = room("Glow")
        shade(scene, height, half, mixed("Backfacing", glow((1, 0.9, 0.8, 1), 0.6 / half**2), back), turn)
        return scene

    return make


def _screen(output, first, second, turn=1):
    def make():
        scene = lit(room("Screen"))
        shade(scene, 1.5, 0.7, mixed(output, first, second), turn)
        return scene

    return make


def _pane():
    """A pane of glass across the room below its lamp, as architects have it: clear to shadow and diffuse rays."""
    scene = lit(room("Pane"))
    made = bpy.data.materials.new("Pane")
    tree = with_nodes(made)
    path = node(tree, "ShaderNodeLightPath").outputs
    either = node(
        tree,
        "ShaderNodeMath",
        {"Value": path["Is Shadow Ray"], "Value_001": path["Is Diffuse Ray"]},
        operation="MAXIMUM",
    )
    glass = node(tree, "ShaderNodeBsdfGlass", {"Color": (0.2, 0.9, 0.4, 1)})
    whole = node(
        tree,
        "ShaderNodeMixShader",
        {"Fac": either.outputs[0], "Shader": glass.outputs[0], "Shader_001": node(tree, clear()[0]).outputs[0]},
    )
    node(tree, "ShaderNodeOutputMaterial", {"Surface": whole.outputs[0]})
    shade(scene, 1.5, 1.49, made)
    return scene


_MAKERS = {
    "glows in front, nothing behind": _one_sided(0.4, 2.2, clear()),
    "the same, facing up": _one_sided(0.4, 2.2, clear(), -1),
    "glows in front, large, nothing behind": _one_sided(1.4, 2.3, clear()),
    "glows in front, grey behind": _one_sided(0.3, 1.8, diffuse(GREY)),
    "glows red in front, blue behind": _one_sided(0.2, 1.5, glow((0.1, 0.2, 1.0, 1), 8.0)),
    "red in front, blue behind": _screen("Backfacing", diffuse(RED), diffuse(BLUE)),
    "the same, turned over": _screen("Backfacing", diffuse(RED), diffuse(BLUE), -1),
    "lets light through downwards, grey from below": _screen(
        "Backfacing", diffuse(GREY), ("ShaderNodeBsdfTranslucent", {"Color": RED})
    ),
    "no shadow": _screen("Is Shadow Ray", diffuse(GREY), clear()),
    "coloured shadow": _screen("Is Shadow Ray", diffuse(GREY), clear((0.9, 0.5, 0.1, 1))),
    "seen by shadow rays alone": _screen("Is Shadow Ray", clear(), diffuse(GREY)),
    "glass of architects": _pane,
}


def _with_grid(make):
    return lambda: (make(), Grid.from_bounds((0.3, 0.3, 0.3), (2.7, 2.7, 2.3), (4, 4, 3)))


ROOMS = {name: _with_grid(make) for name, make in _MAKERS.items()}
