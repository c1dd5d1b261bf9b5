# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes whose value depends on the ray that asks: answered for the diffuse rays of a bake, averaged over directions
with the cosine, or for its shadow rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .albedos import fresnel_mean
from .node_links import Unsupported
from .shader_values import ONE, constant

# Light Path outputs as a diffuse ray after its first bounce sees them.
DIFFUSE_RAY = {
    "Is Diffuse Ray": 1.0,
    "Is Reflection Ray": 1.0,
    "Ray Length": 1.0,
    "Ray Depth": 1.0,
    "Diffuse Depth": 1.0,
}
_SHADOW_RAY = {"Is Shadow Ray": 1.0, "Ray Length": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0}


@dataclass(frozen=True)
class Viewer:
    """What the ray that asks is, and where it looks from."""

    behind: bool = False
    shadow: bool = False  # on its way to a lamp; else one that bounces

    def light_path(self, output: str) -> float:
        """What the Light Path node tells this ray at ``output``."""
        return (_SHADOW_RAY if self.shadow else DIFFUSE_RAY).get(output, 0.0)

    @property
    def backfacing(self) -> float:
        return float(self.behind)


def _light_path(evaluator, node, socket, scope):
    evaluator.asks_kind |= DIFFUSE_RAY.get(socket.name) != _SHADOW_RAY.get(socket.name)
    return constant(evaluator.viewer.light_path(socket.name))


def _geometry(evaluator, node, socket, scope):
    if socket.name == "Backfacing":
        evaluator.asks_side = True
        return constant(evaluator.viewer.backfacing)
    raise Unsupported(f"'{socket.name}' differs from point to point")


def _fresnel(evaluator, node, socket, scope):
    return constant(fresnel_mean(evaluator.input(node, "IOR", scope).number()))


def layer_weight_mean(blend_input: float, output: str) -> float:
    """Cosine-weighted mean of the Layer Weight node's ``output``."""
    weight = float(np.clip(blend_input, 0, 0.999))
    if output == "Fresnel":
        return fresnel_mean(1 / max(1 - weight, 1e-5))
    exponent = 2 * weight if weight < 0.5 else 0.5 / (1 - weight)
    return 1 - 2 / (exponent + 2)  # mean of 1 − cosᵉ under the cosine


def _layer_weight(evaluator, node, socket, scope):
    return constant(layer_weight_mean(evaluator.input(node, "Blend", scope).number(), socket.name))


def _object_info(evaluator, node, socket, scope):
    if socket.name == "Random":
        evaluator.loses_pattern = True
        return constant(0.5)
    raise Unsupported(f"'{socket.name}' differs from object to object")


def _ambient_occlusion(evaluator, node, socket, scope):
    """As if nothing were near: light transport knows what is."""
    return evaluator.input(node, "Color", scope) if socket.name == "Color" else ONE


def _light_falloff(evaluator, node, socket, scope):
    if (
        socket.name == "Quadratic"
        and not evaluator.linked(node, "Smooth", scope)
        and evaluator.input(node, "Smooth", scope).is_zero()
    ):
        return evaluator.input(node, "Strength", scope)
    raise Unsupported("only quadratic falloff without smoothing is physical")


RAY_NODES = {
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeFresnel": _fresnel,
    "ShaderNodeLayerWeight": _layer_weight,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeAmbientOcclusion": _ambient_occlusion,
    "ShaderNodeLightFalloff": _light_falloff,
}
