# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface shader nodes as one closure: how much they reflect diffusely, let through and emit.

What each closure becomes is chosen so that the light that leaves the surface, summed over all directions, is as close
to Cycles as a diffuse reflector with holes can be:

- Diffuse, Subsurface, Toon, Sheen reflect diffusely what they send back in all. Of glossy nodes, metal and the specular
  and coat layers of Principled the same is counted in (``albedos``), and which part of it is mirrored
  (``gloss_lobes``), if that is enough and sharp enough to matter.
- Translucent lets light through diffusely: what arrives on one side leaves on the other.
- Transparent, Glass, Refraction and the transmitting part of Principled let light through unbent: a hole, which may be
  coloured. Thin panes are what such materials mostly are, and caustics of solid glass are beyond a light probe.
- Mix Shader and Add Shader combine these per pixel. Normal inputs turn light, which is ignored; what normal
  maps lose by it is not.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .albedos import (
    dielectric_albedo,
    facing_reflectance,
    glossy_albedo,
    layered,
    metal_albedo,
    rough_diffuse_albedo,
    sheen_albedo,
    tinted_coat,
)
from .gloss_lobes import NOTHING_MIRRORED, Mirrored, joined
from .node_links import Scope, Unsupported, find_socket, resolve
from .normal_maps import share_sent_back
from .shader_nodes import NodeEvaluator
from .shader_values import ONE, ZERO, Value, add, apply, blend, complement, constant, multiply

DEFAULT_GREY = constant([0.8, 0.8, 0.8])
WHITE = constant([1.0, 1.0, 1.0])
_UNTURNED = 0.999  # share that normal maps of no effect leave
_GREY = 0.02  # difference of channels up to which transparency counts as grey: part hole, part black


@dataclass(frozen=True)
class Closure:
    """``diffuse`` is the albedo of the part that is not hole, ``through`` what that part lets through diffusely,
    ``opacity`` its share of the whole, ``emission`` radiance of the whole, ``tint`` what the hole leaves of light that
    passes it. Of ``diffuse`` the part ``mirrored`` is not diffuse at all.
    """

    diffuse: Value = constant([0.0, 0.0, 0.0])
    opacity: Value = ONE
    emission: Value = constant([0.0, 0.0, 0.0])
    through: Value = constant([0.0, 0.0, 0.0])
    tint: Value = WHITE
    mirrored: Mirrored = NOTHING_MIRRORED


BLACK = Closure()
HOLE = Closure(opacity=ZERO)


def evaluate_shader(evaluator: NodeEvaluator, socket: bpy.types.NodeSocket, scope: Scope | None = None) -> Closure:
    """Closure that arrives at the shader input ``socket``; without a link that is black, as in Cycles."""
    try:
        source, scope = resolve(socket, scope)
    except Unsupported as reason:
        evaluator.notices.append(f"{evaluator.owner}: {reason}; default grey is used")
        return Closure(DEFAULT_GREY)
    if not source.is_output:
        return BLACK
    node = source.node
    if source.type != "SHADER":  # a colour plugged into a shader input emits
        return Closure(emission=_as_color(evaluator.output(source, scope)))
    evaluate = _SHADERS.get(node.bl_idname)
    if evaluate is not None:
        return evaluate(evaluator, node, scope)
    name = next((name for name in ("Color", "Base Color") if find_socket(node.inputs, name) is not None), None)
    used = "its colour is used as a diffuse one" if name else "default grey is used"
    evaluator.notices.append(f"{evaluator.owner}: shader node '{node.name}' ({node.bl_label}) is not supported; {used}")
    return Closure(evaluator.input(node, name, scope) if name else DEFAULT_GREY)


def _as_color(value: Value) -> Value:
    return value if value.scale.size == 3 else value.scaled(np.ones(3))


def _principled(evaluator, node, scope):
    """The layers of Cycles' Principled BSDF from the inside out, each with its mean albedo."""

    def value(name):
        return evaluator.input(node, name, scope)

    roughness, metallic = value("Roughness").number(), _unit(value("Metallic"))
    through = _unit(value("Transmission Weight"))
    ior, level = value("IOR").number(), value("Specular IOR Level").number()
    share = dielectric_albedo(ior, roughness, level)
    albedo = rough_diffuse_albedo(value("Base Color"), value("Diffuse Roughness").number())
    albedo = _turned(evaluator, node, scope, albedo)
    specular, facing = (
        value("Specular Tint").scaled(share),
        value("Specular Tint").rgb() * facing_reflectance(ior, level),
    )
    albedo = layered(specular, share, albedo)
    mirrored = Mirrored(specular, facing, roughness)
    if not metallic.is_zero():
        metal = metal_albedo(value("Base Color"), roughness)
        albedo = blend(metallic, albedo, metal)
        facing = facing + (value("Base Color").rgb() - facing) * metallic.number()
        mirrored = Mirrored(blend(metallic, specular, metal), facing, roughness)
    opacity, tint = _unit(value("Alpha")), WHITE
    if not through.is_zero():
        evaluator.notices.group("glass lets light through unbent", evaluator.owner_name)
        alpha = opacity
        opacity = apply(lambda a, t, m: a * (1 - t * (1 - m)), alpha, through, metallic)
        # Two faces of a solid take the root of its colour each.
        glass = apply(lambda color: np.sqrt(np.clip(color, 0, 1)), value("Base Color"))
        tint = _mixed_tint(complement(alpha), WHITE, apply(np.subtract, alpha, opacity), glass)
    coat = _unit(value("Coat Weight"))
    if not coat.is_zero():
        ior, roughness = value("Coat IOR").number(), value("Coat Roughness").number()
        share = coat.number() * dielectric_albedo(ior, roughness)
        albedo = layered(constant(share), share, tinted_coat(albedo, coat, value("Coat Tint")))
        below = tinted_coat(mirrored.color, coat, value("Coat Tint")).scaled(1 - share)
        mirrored = joined(
            mirrored.of(below), Mirrored(constant([share] * 3), np.full(3, facing_reflectance(ior)), roughness)
        )
    sheen = _unit(value("Sheen Weight"))
    if not sheen.is_zero():
        share = sheen.number() * sheen_albedo(value("Sheen Roughness").number())
        albedo = layered(value("Sheen Tint").scaled(share), share, albedo)
        mirrored = mirrored.of(mirrored.color.scaled(1 - share))
    strength = value("Emission Strength")
    emission = Closure.emission if strength.is_zero() else multiply(value("Emission Color"), strength)
    return Closure(albedo, opacity, emission, tint=tint, mirrored=mirrored)


def _unit(value: Value) -> Value:
    return apply(lambda array: np.clip(array, 0, 1), value)


def _eevee_specular(evaluator, node, scope):
    return Closure(
        evaluator.input(node, "Base Color", scope),
        complement(evaluator.input(node, "Transparency", scope)),
        evaluator.input(node, "Emissive Color", scope),
    )


def _diffuse(evaluator, node, scope):
    return Closure(evaluator.input(node, "Color", scope))


def _glossy(evaluator, node, scope):
    roughness = evaluator.input(node, "Roughness", scope).number()
    if node.bl_idname == "ShaderNodeBsdfMetallic":
        color = evaluator.input(node, "Base Color", scope)
        if getattr(node, "fresnel_type", "") == "PHYSICAL_CONDUCTOR":
            evaluator.notices.group("physical conductors reflect a mean grey", evaluator.owner_name)
            color = constant([0.57, 0.53, 0.5])
        albedo = metal_albedo(color, roughness)
        return Closure(albedo, mirrored=Mirrored(albedo, color.rgb(), roughness))
    color = evaluator.input(node, "Color", scope)
    albedo = glossy_albedo(color, roughness, getattr(node, "distribution", "") == "MULTI_GGX")
    return Closure(albedo, mirrored=Mirrored(albedo, np.ones(3), roughness))


def _turned(evaluator, node, scope, albedo: Value) -> Value:
    share = share_sent_back(evaluator, node, scope)
    return albedo if share > _UNTURNED else albedo.scaled(share)


def _sheen(evaluator, node, scope):
    albedo = sheen_albedo(evaluator.input(node, "Roughness", scope).number())
    return Closure(evaluator.input(node, "Color", scope).scaled(albedo))


def _rough_diffuse(evaluator, node, scope):
    roughness = evaluator.input(node, "Roughness", scope).number()
    albedo = rough_diffuse_albedo(evaluator.input(node, "Color", scope), roughness)
    return Closure(_turned(evaluator, node, scope, albedo))


def _translucent(evaluator, node, scope):
    return Closure(through=evaluator.input(node, "Color", scope))


def _glass(evaluator, node, scope):
    evaluator.notices.group("glass lets light through unbent", evaluator.owner_name)
    return Closure(opacity=ZERO, tint=_unit(evaluator.input(node, "Color", scope)))


def _transparent(evaluator, node, scope):
    color = _unit(evaluator.input(node, "Color", scope))
    if float(np.ptp(np.broadcast_to(color.array(), (*color.array().shape[:-1], 3)), axis=-1).max()) <= _GREY:
        return Closure(opacity=apply(lambda rgb: 1 - rgb.mean(axis=-1, keepdims=True), color))
    return Closure(
        opacity=apply(lambda rgb: 1 - rgb.max(axis=-1, keepdims=True), color),
        tint=apply(lambda rgb: rgb / np.maximum(rgb.max(axis=-1, keepdims=True), 1e-6), color),
    )


def _emission(evaluator, node, scope):
    return Closure(emission=multiply(evaluator.input(node, "Color", scope), evaluator.input(node, "Strength", scope)))


def _holdout(evaluator, node, scope):
    evaluator.notices.group("holdout shaders are black to light", evaluator.owner_name)
    return BLACK


def _mix(evaluator, node, scope):
    factor = evaluator.input(node, "Fac", scope)
    first, second = (evaluate_shader(evaluator, node.inputs[index], scope) for index in (1, 2))
    if factor.is_constant:
        share = float(np.clip(factor.number(), 0, 1))
        if share in (0.0, 1.0):
            return second if share else first
        factor = constant(share)
    else:
        factor = apply(lambda f: np.clip(f, 0, 1), factor)

    def mixed(color: Value, other_color: Value) -> Value:
        return _opaque_mix(factor, first.opacity, second.opacity, color, other_color)

    none = constant([0.0, 0.0, 0.0])
    return Closure(
        mixed(first.diffuse, second.diffuse),
        blend(factor, first.opacity, second.opacity),
        blend(factor, first.emission, second.emission),
        mixed(first.through, second.through),
        _mixed_tint(
            apply(lambda f, o: (1 - o) * (1 - f), factor, first.opacity),
            first.tint,
            apply(lambda f, o: (1 - o) * f, factor, second.opacity),
            second.tint,
        ),
        mirrored=joined(
            first.mirrored.of(mixed(first.mirrored.color, none)), second.mirrored.of(mixed(none, second.mirrored.color))
        ),
    )


def _mixed_tint(share: Value, tint: Value, other_share: Value, other_tint: Value) -> Value:
    """Colour of two holes together, which take these shares of the area."""
    if tint is other_tint or other_share.is_zero():
        return tint
    if share.is_zero():
        return other_tint

    def weighted(a, color, b, other):
        total = a + b
        return (a * color + b * other) / np.where(total > 0, total, 1)

    return apply(weighted, share, tint, other_share, other_tint)


def _opaque_mix(factor: Value, opacity: Value, other_opacity: Value, color: Value, other_color: Value) -> Value:
    """Colour of the opaque part of a mix of two: a hole takes part of the area, not of the colour."""
    if opacity.is_zero():
        return other_color
    if other_opacity.is_zero():
        return color
    if opacity.is_one() and other_opacity.is_one():
        return blend(factor, color, other_color)

    def weighted(f, first_opacity, second_opacity, first_color, second_color):
        one, other = first_opacity * (1 - f), second_opacity * f
        total = one + other
        return (first_color * one + second_color * other) / np.where(total > 0, total, 1)

    return apply(weighted, factor, opacity, other_opacity, color, other_color)


def _add(evaluator, node, scope):
    first, second = (evaluate_shader(evaluator, item, scope) for item in node.inputs[:2])
    emission = add(first.emission, second.emission)
    if first.opacity.is_one() and second.opacity.is_one():
        through = add(first.through, second.through)
        mirrored = joined(first.mirrored, second.mirrored)
        return Closure(add(first.diffuse, second.diffuse), ONE, emission, through, mirrored=mirrored)
    opacity = apply(
        lambda a, b: np.clip(a + b - 1, 0, 1), first.opacity, second.opacity
    )  # what both let through adds up

    def of_opaque(color, other_color):
        return apply(
            lambda a, b, c, d, o: np.where(o > 0, np.clip((a * b + c * d) / np.where(o > 0, o, 1), 0, 1), 0),
            color,
            first.opacity,
            other_color,
            second.opacity,
            opacity,
        )

    diffuse, through = (of_opaque(getattr(first, name), getattr(second, name)) for name in ("diffuse", "through"))
    none = constant([0.0, 0.0, 0.0])
    mirrored = joined(
        first.mirrored.of(of_opaque(first.mirrored.color, none)),
        second.mirrored.of(of_opaque(none, second.mirrored.color)),
    )
    tint = _mixed_tint(complement(first.opacity), first.tint, complement(second.opacity), second.tint)
    return Closure(diffuse, opacity, emission, through, tint, mirrored=mirrored)


_SHADERS = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeEeveeSpecular": _eevee_specular,
    "ShaderNodeBsdfDiffuse": _rough_diffuse,
    "ShaderNodeSubsurfaceScattering": _diffuse,
    "ShaderNodeBsdfToon": _diffuse,
    "ShaderNodeBsdfSheen": _sheen,
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _glossy,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _glass,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeEmission": _emission,
    "ShaderNodeHoldout": _holdout,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}
