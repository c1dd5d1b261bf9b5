# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes for the tests of ``scene/``."""

import bpy
import numpy as np


def empty_scene():
    """A fresh file without objects; returns its scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def mesh(name, vertices, faces):
    """A mesh datablock; UVs of every map run with x and y."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, [], faces)
    return data


def quad(name="quad", uv_map=None):
    """The square −1..1 at z = 0, facing +Z."""
    data = mesh(name, [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [(0, 1, 2, 3)])
    if uv_map:
        data.uv_layers.new(name=uv_map).uv.foreach_set("vector", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    return data


def place(data, name=None, collection=None, **properties):
    """An object of ``data`` in the scene with its properties set."""
    item = bpy.data.objects.new(name or (data.name if data else "Empty"), data)
    (collection or bpy.context.scene.collection).objects.link(item)
    for key, value in properties.items():
        setattr(item, key, value)
    return item


def with_nodes(block):
    """``block`` (material, world or light) with an empty node tree; returns the tree."""
    if not block.use_nodes:
        block.use_nodes = True
    block.node_tree.nodes.clear()
    return block.node_tree


def node(tree, kind, inputs=None, **properties):
    """A new node; ``inputs`` maps socket identifiers or names to values or to output sockets to link."""
    made = tree.nodes.new(kind)
    for key, value in properties.items():
        setattr(made, key, value)
    for key, value in (inputs or {}).items():
        socket = next((item for item in made.inputs if item.identifier == key), None) or made.inputs[key]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return made


def material(name, kind="ShaderNodeBsdfDiffuse", inputs=None):
    """A material of one shader node."""
    made = bpy.data.materials.new(name)
    tree = with_nodes(made)
    shader = node(tree, kind, inputs)
    node(tree, "ShaderNodeOutputMaterial", {"Surface": shader.outputs[0]})
    return made


def image(name, pixels, colorspace="Linear Rec.709", float_buffer=True):
    """An image datablock of ``pixels`` (height, width, 4)."""
    height, width = pixels.shape[:2]
    made = bpy.data.images.new(name, width, height, alpha=True, float_buffer=float_buffer)
    made.colorspace_settings.name = colorspace
    made.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    made.update()
    return made
