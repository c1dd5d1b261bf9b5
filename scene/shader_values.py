# SPDX-License-Identifier: GPL-3.0-or-later
"""What a shader socket carries: a constant, or a value per pixel of a texture domain. numpy only.

Node graphs are evaluated once per pixel of the textures that feed them, so any chain of per-pixel nodes (mix, ramp,
curves, hue, math) ends as one plain texture that a probe bake can sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..core.conventions import LUMINANCE
from ..core.kept import OncePerArray


@dataclass(frozen=True)
class Domain:
    """Where pixels lie on a surface: texture coordinate = ``matrix`` · (u, v, 1) of the UV map.

    ``uv_map`` "" is the mesh's active one; None means that pixels are samples without a place (a procedural texture's
    spread of values), of which only the mean reaches the surface.
    """

    uv_map: str | None = ""
    matrix: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # (2, 3), row-major
    extension: str = "REPEAT"


SCATTERED = Domain(uv_map=None)


def _planes(pixels: np.ndarray) -> np.ndarray:
    """(channels, height, width): numpy is five times as fast plane by plane."""
    return np.moveaxis(pixels, -1, 0)


# (channels,) of pixels (height, width, channels); asked for again and again, of images of a million pixels.
_mean = OncePerArray(lambda pixels: np.array([plane.mean(dtype=float) for plane in _planes(pixels)]))
_extremes = OncePerArray(
    lambda pixels: np.array([(plane.min(), plane.max()) for plane in _planes(pixels)], np.float32).T
)


@dataclass(frozen=True)
class Value:
    """``scale`` (1,) or (3,) times ``pixels`` (height, width, 1 or 3), or ``scale`` alone where there are none.

    The factor is kept apart so that one texture in many tints stays one array.
    """

    scale: np.ndarray
    pixels: np.ndarray | None = None
    domain: Domain | None = None

    @property
    def is_constant(self) -> bool:
        return self.pixels is None

    def array(self) -> np.ndarray:
        """(channels,) or (height, width, channels) float32."""
        return self.scale if self.pixels is None else self.pixels * self.scale

    def mean(self) -> np.ndarray:
        """(channels,) average."""
        return self.scale if self.pixels is None else _mean(self.pixels) * self.scale

    def least(self) -> float:
        """The smallest value of any channel anywhere."""
        if self.pixels is None:
            return float(self.scale.min())
        return float(min((extreme * self.scale).min() for extreme in _extremes(self.pixels)))

    def rgb(self) -> np.ndarray:
        """(3,) average as a colour."""
        return np.broadcast_to(self.mean(), 3).astype(float)

    def number(self) -> float:
        """Average as one number: the luminance of colours."""
        mean = self.mean()
        return float(mean[0] if len(mean) == 1 else mean @ LUMINANCE)

    def is_zero(self) -> bool:
        return not self.scale.any() or (self.pixels is not None and not _extremes(self.pixels).any())

    def is_one(self) -> bool:
        return self.is_constant and bool((self.scale == 1).all())

    def scaled(self, factor) -> Value:
        return replace(self, scale=self.scale * np.atleast_1d(np.asarray(factor, np.float32)))


def constant(value) -> Value:
    """A Value of one number or of (3,) numbers."""
    return Value(np.atleast_1d(np.asarray(value, np.float32)))


ZERO, ONE = constant(0.0), constant(1.0)


def as_number(value: Value) -> Value:
    """Colour to float by luminance, as a float socket does."""
    if value.scale.size == 1 and (value.pixels is None or value.pixels.shape[2] == 1):
        return value
    return apply(
        lambda color: np.broadcast_to(color, (*color.shape[:-1], 3)) @ LUMINANCE.astype(np.float32)[:, None], value
    )


def apply(function: Callable[..., np.ndarray], *values: Value) -> Value:
    """``function`` of the arrays of ``values``, per pixel.

    Textures of one domain are combined pixel by pixel at the finest resolution among them. A texture of another domain
    than the first (finest) one enters with its mean: two unrelated patterns cannot share one image.
    """
    textured = [value for value in values if not value.is_constant]
    if not textured:
        return Value(np.asarray(function(*(value.scale for value in values)), np.float32))
    placed = [value for value in textured if value.domain.uv_map is not None] or textured
    main = max(placed, key=lambda value: value.pixels.size)
    shape = main.pixels.shape[:2]
    arrays = []
    for value in values:
        if value.is_constant or value.domain != main.domain:
            arrays.append(value.mean().astype(np.float32)[None, None])
        else:
            arrays.append(_resampled(value.array(), shape))
    result = np.asarray(function(*arrays), np.float32)
    result = np.broadcast_to(result, (*shape, result.shape[-1]))
    return Value(np.ones(1, np.float32), np.ascontiguousarray(result), main.domain)


def mixed_domains(*values: Value) -> bool:
    """Whether ``apply`` has to replace a placed texture by its mean."""
    return len({value.domain for value in values if not value.is_constant and value.domain.uv_map is not None}) > 1


def multiply(first: Value, second: Value) -> Value:
    """Product; a constant factor leaves the other's pixels untouched."""
    if first.is_constant:
        return second.scaled(first.scale)
    if second.is_constant:
        return first.scaled(second.scale)
    return apply(np.multiply, first, second)


def add(first: Value, second: Value) -> Value:
    if first.is_zero():
        return second
    if second.is_zero():
        return first
    return apply(np.add, first, second)


def complement(value: Value) -> Value:
    """1 − value."""
    return apply(lambda array: 1 - array, value)


def blend(factor: Value, first: Value, second: Value) -> Value:
    """first · (1 − factor) + second · factor."""
    if first is second or (first.is_zero() and second.is_zero()):
        return first
    if factor.is_constant and factor.scale.size == 1:
        weight = float(factor.scale[0])
        return add(first.scaled(1 - weight), second.scaled(weight))
    return apply(lambda f, a, b: a * (1 - f) + b * f, factor, first, second)


def _resampled(array: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Nearest sample of ``array`` (height, width, channels) on a grid of ``shape``."""
    if array.shape[:2] == shape:
        return array
    rows = (np.arange(shape[0]) + 0.5) * array.shape[0] / shape[0]
    columns = (np.arange(shape[1]) + 0.5) * array.shape[1] / shape[1]
    return array[rows.astype(int)[:, None], columns.astype(int)[None]]
