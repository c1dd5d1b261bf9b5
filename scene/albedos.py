# SPDX-License-Identifier: GPL-3.0-or-later
"""How much light Cycles' closures send back in all, under light from everywhere: what a diffuse stand-in must reflect.

The tables are albedos of a plane under a white sky by Cycles 5.2, 128×64 pixels; ``tests/blender/test_albedos.py``
renders some of them again. numpy only.
"""

from __future__ import annotations

import numpy as np

from .shader_values import Value, apply, constant, multiply

_ROUGHNESS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
# Share of the light that leaves a rough surface after one reflection, by roughness, for mean Fresnel reflectances of
# _REFLECTANCE: what grazes a rough surface, where little reflectance has most of its light, gets lost first.
_REFLECTANCE = np.array([0.092, 0.222, 0.524, 1.0])
_SINGLE = np.array(
    [
        [1.0, 0.907, 0.629, 0.388, 0.223],
        [1.0, 0.958, 0.794, 0.567, 0.350],
        [1.0, 0.973, 0.839, 0.617, 0.386],
        [1.0, 0.988, 0.883, 0.655, 0.414],
    ]
)
_SHEEN_ROUGHNESS = np.array([0.0, 0.1, 0.25, 0.5, 0.75, 1.0])
_SHEEN = np.array([0.0, 0.002, 0.0225, 0.118, 0.278, 0.447])

COAT_PATH = 1.13  # mean length of the way through a coat, once its thickness


def fresnel_mean(ior: float) -> float:
    """Cosine-weighted mean reflectance of a smooth dielectric. E. d'Eon's fit, good to 0.003 for 1 < ior < 2.5."""
    return (ior - 1) / (4.08567 + 1.00071 * ior) if ior > 1 else 0.0


def facing_reflectance(ior: float, level: float = 0.5) -> float:
    """Reflectance of the same at normal incidence."""
    return min(((ior - 1) / (ior + 1)) ** 2 * 2 * max(level, 0.0), 0.99)


def dielectric_albedo(ior: float, roughness: float, level: float = 0.5) -> float:
    """Specular reflectance of a Principled BSDF whose Specular IOR Level is ``level``."""
    normal = facing_reflectance(ior, level)
    return float(_rough(np.array(fresnel_mean((1 + normal**0.5) / (1 - normal**0.5))), roughness))


def metal_albedo(color: Value, roughness: float) -> Value:
    """Metal of the reflectance ``color`` at normal incidence; Schlick's mean over the cosine adds 1/21 of the rest."""
    return apply(lambda c: _rough(c + (1 - c) / 21, roughness), color)


def glossy_albedo(color: Value, roughness: float, multiple: bool) -> Value:
    """A Glossy BSDF, with or without ``multiple`` scattering between its microfacets."""
    single = np.interp(roughness, _ROUGHNESS, _SINGLE[-1])
    if not multiple:
        return color.scaled(single)
    return apply(lambda c: c * single / (1 - np.clip(c, 0, 1) * (1 - single)), color)


def rough_diffuse_albedo(color: Value, roughness: float) -> Value:
    """A Diffuse BSDF of the given roughness (Oren and Nayar with energy kept)."""
    if roughness <= 0:
        return color
    single = 1 / (1 + min(roughness, 1.0) / 5)
    return apply(lambda c: c * (single + (1 - single) * np.clip(c, 0, 1) ** 2), color)


def sheen_albedo(roughness: float) -> float:
    """A white Sheen BSDF."""
    return float(np.interp(roughness, _SHEEN_ROUGHNESS, _SHEEN))


def layered(top: Value, share: float, below: Value) -> Value:
    """A layer that reflects ``top``, and takes ``share`` from what is ``below``."""
    if share <= 0:
        return below
    if top.is_constant and below.is_constant:
        return constant(top.scale + (1 - share) * below.scale)
    return apply(lambda t, b: t + (1 - share) * b, top, below)


def _rough(reflectance: np.ndarray, roughness: float) -> np.ndarray:
    """Smooth ``reflectance`` made rough, with what bounces between the microfacets."""
    reflectance = np.clip(reflectance, 0, 1)
    column = [np.interp(roughness, _ROUGHNESS, row) for row in _SINGLE]
    single = np.interp(reflectance, _REFLECTANCE, column)
    return reflectance * single / (1 - reflectance * (1 - single))


def tinted_coat(color: Value, weight: Value, tint: Value) -> Value:
    """``color`` seen through a coat of ``weight`` and colour ``tint``."""
    return multiply(color, apply(lambda w, t: 1 - w + w * np.clip(t, 0, 1) ** COAT_PATH, weight, tint))
