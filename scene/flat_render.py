# SPDX-License-Identifier: GPL-3.0-or-later
"""What a socket of a material evaluates to, rendered by Cycles on a unit square.

Seen from above, the square runs from −½ to ½ in x and y; it is tilted so that z takes all those values too, which shows
what varies with height. Its UVs run from 0 to 1 as its picture does, its Generated coordinates along all three axes.
"""

from __future__ import annotations

import bpy
import numpy as np

from .cycles_reference import unbiased_settings
from .node_links import Scope, find_socket
from .temporary import leave_nothing_behind, new_camera, plain_render_settings, render_pixels


def render_socket(
    material: bpy.types.Material, socket: bpy.types.NodeSocket, scope: Scope | None, edge: int, uv_map: str = ""
) -> np.ndarray:
    """(edge, edge, 3) float32 values of the output ``socket`` over the square, row 0 at v = 0, one sample per pixel.

    ``uv_map`` is the name under which nodes ask for the square's UVs.
    """
    with leave_nothing_behind():
        copy = material.copy()
        output = exposed_in_groups(copy.node_tree, socket, scope)
        show_alone(copy.node_tree, output)
        return _render(copy, edge, uv_map or "UVMap")


def show_alone(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket) -> None:
    """Make the material ``tree`` emit what ``output`` carries, and nothing else."""
    emission, target = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], target.inputs["Surface"])
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeOutputMaterial" and node != target:
            tree.nodes.remove(node)


def exposed_in_groups(
    tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, scope: Scope | None
) -> bpy.types.NodeSocket:
    """The socket of the copied material ``tree`` that carries ``socket``'s value.

    A socket inside node groups is led out through a new output of each, on copies of the groups.
    """
    if scope is None:
        return find_socket(tree.nodes[socket.node.name].outputs, socket.identifier)
    path: list[str] = []  # group nodes from the outside in
    while scope is not None:
        path.insert(0, scope.node.name)
        scope = scope.parent
    groups = []
    for name in path:
        group = tree.nodes[name]
        group.node_tree = group.node_tree.copy()
        groups.append(group)
        tree = group.node_tree
    value = find_socket(tree.nodes[socket.node.name].outputs, socket.identifier)
    for group in reversed(groups):
        inner = group.node_tree
        exposed = inner.interface.new_socket("Gridlight", in_out="OUTPUT", socket_type="NodeSocketColor")
        for node in [node for node in inner.nodes if node.type == "GROUP_OUTPUT"]:
            inner.links.new(value, find_socket(node.inputs, exposed.identifier))
        value = find_socket(group.outputs, exposed.identifier)
    return value


def _render(material: bpy.types.Material, edge: int, uv_map: str) -> np.ndarray:
    square = bpy.data.meshes.new("Gridlight Square")
    square.from_pydata([(-0.5, -0.5, -0.5), (0.5, -0.5, 0), (0.5, 0.5, 0.5), (-0.5, 0.5, 0)], [], [(0, 1, 2, 3)])
    square.uv_layers.new(name=uv_map).uv.foreach_set("vector", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    square.materials.append(material)
    scene = bpy.data.scenes.new("Gridlight Flat Render")
    scene.collection.objects.link(bpy.data.objects.new("Gridlight Square", square))
    scene.camera = new_camera(scene)
    scene.camera.location.z = 2
    scene.camera.data.type = "ORTHO"
    scene.camera.data.ortho_scale = 1.0
    plain_render_settings(scene)
    unbiased_settings(scene, samples=1, bounces=0)
    scene.render.use_persistent_data = False  # Cycles would look for this scene when it is gone
    scene.render.resolution_x = scene.render.resolution_y = edge
    return render_pixels(scene, scene.view_layers[0].name)
