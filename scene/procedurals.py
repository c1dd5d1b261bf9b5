# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures and other nodes without a counterpart here, answered by a flat render of their output.

A texture that depends on UVs alone becomes an image of the first UV tile. One that depends on the place in space cannot
be laid on a surface without the surface; its spread of values still goes through the nodes behind it, and their mean
colour is what the surface gets: the mean of a ramp is not the ramp of a mean.
"""

from __future__ import annotations

import bpy
import numpy as np

from .flat_render import render_socket
from .node_links import Scope, Unsupported, resolve
from .shader_values import SCATTERED, Domain, Value

_PLACED_EDGE, _SCATTERED_EDGE = 256, 64

# Their values belong to an object, a light path or a picture, which the flat square is not.
_OBJECT_BOUND = {
    "ShaderNodeAttribute",
    "ShaderNodeVertexColor",
    "ShaderNodeObjectInfo",
    "ShaderNodeParticleInfo",
    "ShaderNodeHairInfo",
    "ShaderNodePointInfo",
    "ShaderNodeNewGeometry",
    "ShaderNodeCameraData",
    "ShaderNodeTexPointDensity",
    "ShaderNodeTexIES",
    "ShaderNodeShaderToRGB",
    "ShaderNodeScript",
    "ShaderNodeAmbientOcclusion",
    "ShaderNodeBevel",
    "ShaderNodeWireframe",
    "ShaderNodeTangent",
    "ShaderNodeNormalMap",
    "ShaderNodeUVAlongStroke",
    "ShaderNodeRaycast",
    "ShaderNodeVolumeInfo",
    "ShaderNodeTexEnvironment",
}


def sampler_of(material: bpy.types.Material):
    """The ``sample`` of a ``NodeEvaluator`` for ``material``."""

    def sample(evaluator, socket: bpy.types.NodeSocket, scope: Scope | None) -> Value:
        origins: set[str | None] = set()
        _survey(socket, scope, origins, set())
        placed = len(origins) == 1 and None not in origins
        uv_map = next(iter(origins)) if placed else ""
        edge = _PLACED_EDGE if placed else _SCATTERED_EDGE
        pixels = render_socket(material, socket, scope, edge, uv_map)
        if socket.type == "VALUE":
            pixels = np.ascontiguousarray(pixels[..., :1])
        reason = (
            "procedural textures on UVs become images of the first UV tile"
            if placed
            else "procedural textures enter with their mean colour"
        )
        if origins:  # without any, the node only computes
            evaluator.loses_pattern |= not placed
            evaluator.notices.group(reason, f"{evaluator.owner_name} > {socket.node.name}")
        return Value(np.ones(1, np.float32), pixels, Domain(uv_map) if placed else SCATTERED)

    return sample


def _survey(socket, scope, origins: set, seen: set) -> None:
    """Collect what the output ``socket`` depends on: names of UV maps ("" the active one), None for other coordinates.

    Raises:
        Unsupported: it depends on an object.
    """
    node = socket.node
    if node.bl_idname in _OBJECT_BOUND:
        raise Unsupported(f"{node.bl_label} has no counterpart here")
    if node.bl_idname == "ShaderNodeTexCoord":
        if socket.name not in ("UV", "Generated", "Object"):
            raise Unsupported(f"{socket.name} coordinates")
        origins.add("" if socket.name == "UV" else None)
    elif node.bl_idname == "ShaderNodeUVMap":
        origins.add(node.uv_map)
    if (node, scope) in seen:
        return
    seen.add((node, scope))
    for item in node.inputs:
        if not item.enabled:
            continue
        source, source_scope = resolve(item, scope)
        if source.is_output:
            _survey(source, source_scope, origins, seen)
        elif (
            item.name == "Vector"
            and node.bl_idname.startswith("ShaderNodeTex")
            and node.bl_idname != "ShaderNodeTexWhiteNoise"
        ):
            origins.add("" if node.bl_idname == "ShaderNodeTexImage" else None)
