# SPDX-License-Identifier: GPL-3.0-or-later
"""The materials of the demo gallery: Principled, diffuse, base colours of at most 0.85.

Nothing here is glossy: what the probes hold is diffuse light, and the demo is also the scene that bakes are judged on.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import gallery_painting

# Base colour, scene linear.
PLAIN = {
    "Plaster": (0.78, 0.76, 0.72),
    "Ceiling": (0.82, 0.81, 0.78),
    "Crimson wall": (0.52, 0.035, 0.035),
    "Teal wall": (0.02, 0.33, 0.38),
    "Ochre wall": (0.72, 0.40, 0.05),
    "Green wall": (0.10, 0.40, 0.14),
    "Coffer": (0.32, 0.48, 0.66),
    "Limestone": (0.66, 0.62, 0.54),
    "Walnut": (0.16, 0.085, 0.045),
    "Gilding": (0.70, 0.46, 0.13),
    "Marble": (0.82, 0.81, 0.79),
    "Panel": (0.27, 0.43, 0.39),
    "Ultramarine": (0.02, 0.05, 0.55),
    "Terracotta": (0.62, 0.24, 0.11),
    "Celadon": (0.36, 0.55, 0.45),
    "Leather": (0.33, 0.12, 0.05),
    "Iron": (0.05, 0.05, 0.055),
    "Exterior": (0.45, 0.43, 0.40),
}

# Emitted radiance, W/(m² sr).
GLOWING = {
    "Alabaster glow": (2.7, 1.95, 1.15),
    "Cove glow": (3.0, 2.5, 1.9),
    "Panel glow": (2.3, 2.0, 1.6),
}

PAINTED = {
    "Oak parquet": gallery_painting.oak_parquet,
    "Stone tiles": gallery_painting.stone_tiles,
    "Ridges at Dusk": gallery_painting.ridges_at_dusk,
    "Rings": gallery_painting.rings,
    "Tide": gallery_painting.tide,
}


def gallery_materials() -> dict[str, bpy.types.Material]:
    """New materials by name; Blender numbers the names that are taken already."""
    made = {}
    for name, colour in PLAIN.items():
        made[name], _, _ = _principled(name, colour)
    for name, radiance in GLOWING.items():
        made[name], _, shader = _principled(name, (0.8, 0.8, 0.8))
        strength = max(radiance)
        shader.inputs["Emission Color"].default_value = (*np.array(radiance) / strength, 1.0)
        shader.inputs["Emission Strength"].default_value = strength
    for name, paint in PAINTED.items():
        made[name], tree, shader = _principled(name, (0.8, 0.8, 0.8))
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.location = shader.location.x - 320, shader.location.y
        texture.image = gallery_painting.packed_image(name, paint())
        tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    return made


def _principled(name: str, colour) -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.diffuse_color = (*colour, 1.0)  # what solid shading shows
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material, tree, shader
