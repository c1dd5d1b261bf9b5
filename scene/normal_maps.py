# SPDX-License-Identifier: GPL-3.0-or-later
"""What normal maps cost: a diffuse surface whose normals are turned, on flat ground, sends less back.

A normal that leans misses the part of its hemisphere below the ground, and where light comes at a slant Cycles takes
away more, by a shadowing function (Estevez, Lecocq and Stein, "A Microfacet-Based Shadowing Function to Solve the Bump
Terminator Problem", Ray Tracing Gems, 2019). What leans one way here leans the other way there: direction does not
stay, the loss does.
"""

from __future__ import annotations

import numpy as np

from .node_links import Scope, Unsupported, find_socket, resolve

# Share of light from evenly all over the hemisphere that a normal which leans by so many degrees sends back: the
# integral of both, over a million directions.
_ANGLES = np.radians([0, 5, 10, 15, 20, 30, 41, 50, 60, 70, 80])
_SHARES = [1.0, 0.996, 0.984, 0.967, 0.943, 0.879, 0.784, 0.689, 0.566, 0.421, 0.343]


def share_sent_back(evaluator, node, scope: Scope | None) -> float:
    """Mean over the map at the Normal input of the shader ``node``; 1 where there is none, or it cannot be read."""
    socket = find_socket(node.inputs, "Normal")
    if socket is None or not socket.is_linked:
        return 1.0
    try:
        source, scope = resolve(socket, scope)
        mapped = source.node
        if not source.is_output or mapped.bl_idname != "ShaderNodeNormalMap" or mapped.space != "TANGENT":
            return 1.0
        strength = max(evaluator.input(mapped, "Strength", scope).number(), 0.0)
        color = evaluator.input(mapped, "Color", scope).array()
    except Unsupported:
        return 1.0
    if color.shape[-1] != 3:
        return 1.0
    normal = 2 * color - 1
    across = strength * np.linalg.norm(normal[..., :2], axis=-1)
    up = 1 + min(strength, 1.0) * (normal[..., 2] - 1)
    return float(np.interp(np.arctan2(across, np.maximum(up, 0.0)), _ANGLES, _SHARES).mean())
