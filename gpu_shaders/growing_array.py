# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear arrays on the GPU that grow and keep what they hold."""

from __future__ import annotations

import gpu

from .dispatch import dispatch_linear
from .programs import program
from .textures import allocate_integers, scratch


def copy_elements(source: gpu.types.GPUTexture, target: gpu.types.GPUTexture, pixel: str, count: int, first: int = 0):
    """Copies the first ``count`` elements of ``source`` to ``target`` from element ``first`` on. ``pixel``: of both."""
    shader = program("copy_elements_comp", PIXEL=pixel, KIND="UINT_2D" if pixel == "R32UI" else "FLOAT_2D")
    shader.uniform_sampler("source", source)
    shader.image("target", target)
    shader.uniform_int("first", (first,))
    shader.uniform_int("count", (count,))
    dispatch_linear(shader, count)


def fill_elements(
    target: gpu.types.GPUTexture,
    first: int,
    count: int,
    value: float,
    factor: tuple[gpu.types.GPUTexture, int] | None = None,
) -> None:
    """Sets ``count`` elements of ``target`` (R32F) from ``first`` on to ``value``, times an element of another array if
    that is given as ``factor``: array and index."""
    shader = program("fill_elements_comp", TIMES=factor is not None)
    shader.image("target", target)
    if factor is not None:
        shader.uniform_sampler("factors", factor[0])
        shader.uniform_int("factor", (factor[1],))
    shader.uniform_int("first", (first,))
    shader.uniform_int("count", (count,))
    shader.uniform_float("value", value)
    dispatch_linear(shader, count)


class GrowingArray:
    """``texture`` holds at least as many elements as were reserved; new ones are ``fill``, or of no defined content
    without."""

    def __init__(self, what: str, pixel: str = "RGBA32F", fill: int | None = None):
        self._what, self._pixel, self._fill = what, pixel, fill
        self.capacity = 0  # elements
        self.texture: gpu.types.GPUTexture | None = None

    def reserve(self, elements: int) -> gpu.types.GPUTexture:
        """Makes room for ``elements`` and returns the texture, which is another one where it had to grow.

        Raises:
            InputError: more elements than one texture holds.
        """
        if self.texture is None or elements > self.capacity:
            before, held = self.texture, self.capacity
            self.capacity = max(elements, held + held // 2, 1)
            self.texture = self._allocate()
            if before is not None:
                copy_elements(before, self.texture, self._pixel, held)
        return self.texture

    def _allocate(self) -> gpu.types.GPUTexture:
        if self._fill is None:
            return scratch(self.capacity, self._what, self._pixel)
        if self._pixel == "R32UI":
            return allocate_integers(self.capacity, self._what, self._fill)
        texture = scratch(self.capacity, self._what, self._pixel)
        texture.clear(format="FLOAT", value=(float(self._fill),) * (4 if self._pixel.startswith("RGBA") else 1))
        return texture


class Scratch:
    """Small arrays whose content nobody asks for later, by name: the same textures again and again, because making one
    takes as long as a small dispatch."""

    _MOST_ELEMENTS = 1 << 19  # of an array that is kept

    def __init__(self) -> None:
        self._kept: dict[str, gpu.types.GPUTexture] = {}

    def __call__(self, name: str, elements: int, what: str, pixel: str = "RGBA32F") -> gpu.types.GPUTexture:
        """At least ``elements`` without defined content. What ``name`` stood for before must have served its turn."""
        kept = self._kept.get(name)
        if kept is not None and kept.width * kept.height >= elements:
            return kept
        texture = scratch(elements, what, pixel)
        if elements <= self._MOST_ELEMENTS:
            self._kept[name] = texture
        return texture

    def release(self) -> None:
        """Lets go of all of them."""
        self._kept.clear()
