# SPDX-License-Identifier: GPL-3.0-or-later
"""A square with one material, for tests of what is read of materials; and a leaf with a hole as its texture."""

import bpy
import numpy as np
from gridlight.scene.read import read_scene
from scene_builders import image, node, place, quad, with_nodes

HALF = np.full((8, 8, 4), 1.0, np.float32)
HALF[..., :3] = [0.2, 0.4, 0.6]
HALF[:, :4, 3] = 0  # left half is a hole
OPAQUE = np.where(np.arange(4) == 3, 1, HALF).astype(np.float32)


def read(scene, made):
    """(Material, snapshot) of ``made`` on a square with UVs."""
    data = quad(uv_map="UVMap")
    data.materials.append(made)
    place(data, "thing")
    snapshot = read_scene(scene)
    return snapshot.materials[0], snapshot


def built(shader_of):
    """A material whose Surface is the output socket that ``shader_of(tree)`` returns."""
    made = bpy.data.materials.new("Subject")
    tree = with_nodes(made)
    node(tree, "ShaderNodeOutputMaterial", {"Surface": shader_of(tree)})
    return made


def textured(tree, kind="Color", pixels=HALF, **properties):
    return node(tree, "ShaderNodeTexImage", image=image("leaf", pixels), **properties).outputs[kind]


def warned(snapshot, *words):
    return any(all(word in line for word in words) for line in snapshot.warnings)
