# SPDX-License-Identifier: GPL-3.0-or-later
"""The arithmetic of Blender's colour and math nodes on numpy arrays, as Blender's manual defines it.

Colours are (…, 3) or (…, 1) float32, numbers (…, 1). Division by zero gives 0, as in Blender.
"""

from __future__ import annotations

import numpy as np


def divide(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.where(b != 0, a / np.where(b != 0, b, 1), 0)


def power(base: np.ndarray, exponent: np.ndarray) -> np.ndarray:
    """Negative bases only have integer powers; everything else without a real value is 0."""
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.power(base.astype(float), exponent), nan=0.0, posinf=0.0, neginf=0.0)


def rgb_to_hsv(color: np.ndarray) -> np.ndarray:
    color = np.broadcast_to(color, (*color.shape[:-1], 3))
    high, low = color.max(-1), color.min(-1)
    chroma = high - low
    safe = np.where(chroma > 0, chroma, 1)
    r, g, b = np.moveaxis(color, -1, 0)
    hue = np.where(high == r, (g - b) / safe, np.where(high == g, 2 + (b - r) / safe, 4 + (r - g) / safe))
    hue = np.where(chroma > 0, hue / 6 % 1, 0)
    return np.stack([hue, divide(chroma, high), high], -1)


def hsv_to_rgb(hsv: np.ndarray) -> np.ndarray:
    h, s, v = np.moveaxis(hsv, -1, 0)
    ramps = np.stack([np.abs(h * 6 - 3) - 1, 2 - np.abs(h * 6 - 2), 2 - np.abs(h * 6 - 4)], -1)
    return ((np.clip(ramps, 0, 1) - 1) * s[..., None] + 1) * v[..., None]


def hue_saturation(hue, saturation, value, factor, color):
    hsv = rgb_to_hsv(color)
    shifted = np.stack(
        [
            (hsv[..., 0] + hue[..., 0] + 0.5) % 1,
            np.clip(hsv[..., 1] * saturation[..., 0], 0, 1),
            hsv[..., 2] * value[..., 0],
        ],
        -1,
    )
    return np.maximum(color * (1 - factor) + hsv_to_rgb(shifted) * factor, 0)


def bright_contrast(color, bright, contrast):
    return np.maximum((1 + contrast) * color + bright - contrast / 2, 0)


def gamma(color, exponent):
    return np.where(color > 0, np.power(np.maximum(color, 1e-30), exponent), color)


def invert(factor, color):
    return color * (1 - factor) + (1 - color) * factor


def _overlay(a, b):
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


def _soft_light(a, b):
    return (1 - a) * b * a + a * (1 - (1 - a) * (1 - b))


def _burn(a, b, f):
    base = 1 - f + f * b
    return np.where(base <= 0, 0, np.clip(1 - divide(1 - a, base), 0, 1))


def _dodge(a, b, f):
    base = 1 - f * b
    return np.where(a == 0, a, np.where(base <= 0, 1, np.minimum(divide(a, base), 1)))


def _exchange(channels: str):
    """HUE, SATURATION, VALUE, COLOR: take some channels of b in HSV."""

    def mix(a, b):
        first, second = rgb_to_hsv(a), rgb_to_hsv(b)
        first, second = np.broadcast_arrays(first, second)
        picked = np.stack([second[..., i] if name in channels else first[..., i] for i, name in enumerate("HSV")], -1)
        keep = (second[..., 1:2] == 0) & ("H" in channels)
        return np.where(keep, a, hsv_to_rgb(picked))

    return mix


# a, b -> full effect; the factor then blends from a.
_BLENDS = {
    "MIX": lambda a, b: b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": divide,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DIFFERENCE": lambda a, b: np.abs(a - b),
    "EXCLUSION": lambda a, b: a + b - 2 * a * b,
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
    "OVERLAY": _overlay,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda a, b: a + 2 * b - 1,
    "HUE": _exchange("H"),
    "SATURATION": _exchange("S"),
    "VALUE": _exchange("V"),
    "COLOR": _exchange("HS"),
}


def mix(blend_type: str, factor, a, b) -> np.ndarray:
    """Blender's Mix Color node without clamping."""
    if blend_type == "BURN":
        return _burn(a, b, factor)
    if blend_type == "DODGE":
        return _dodge(a, b, factor)
    return a * (1 - factor) + _BLENDS[blend_type](a, b) * factor


def _pingpong(a, scale):
    return np.where(scale == 0, 0, np.abs(np.mod(a - scale, np.where(scale == 0, 1, scale * 2)) - scale))


def _wrap(a, high, low):
    span = high - low
    return np.where(span != 0, a - span * np.floor(divide(a - low, span)), low)


# Operations of the Math node; every one takes its three inputs.
MATH = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: power(a, b),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: divide(np.ones_like(a), np.sqrt(np.maximum(a, 0))),
    "LOGARITHM": lambda a, b, c: (
        divide(np.log(np.maximum(a, 1e-30)), np.log(np.maximum(b, 1e-30))) * ((a > 0) & (b > 0))
    ),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)) * 1.0,
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "MODULO": lambda a, b, c: np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1)), 0),
    "FLOORED_MODULO": lambda a, b, c: np.where(b != 0, np.mod(a, np.where(b != 0, b, 1)), 0),
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _pingpong(a, b),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "RADIANS": lambda a, b, c: np.radians(a),
    "DEGREES": lambda a, b, c: np.degrees(a),
}


def map_range(value, from_min, from_max, to_min, to_max, interpolation: str, clamp: bool) -> np.ndarray:
    """The Map Range node of ``interpolation`` LINEAR, SMOOTHSTEP or SMOOTHERSTEP."""
    share = divide(value - from_min, from_max - from_min)
    if interpolation != "LINEAR":
        share = np.clip(share, 0, 1)
        share = (
            share * share * (3 - 2 * share)
            if interpolation == "SMOOTHSTEP"
            else share**3 * (share * (share * 6 - 15) + 10)
        )
    result = to_min + share * (to_max - to_min)
    return np.clip(result, np.minimum(to_min, to_max), np.maximum(to_min, to_max)) if clamp else result
