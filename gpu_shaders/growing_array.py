# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear arrays on the GPU that grow and keep what they hold."""

from __future__ import annotations

import gpu

from .elements import copy_elements, fill_elements
from .textures import scratch


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
        texture = scratch(self.capacity, self._what, self._pixel)
        if self._fill is not None:
            fill_elements(texture, 0, self.capacity, self._fill, self._pixel)
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
