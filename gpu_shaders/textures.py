# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays on the GPU: linear arrays of vec4 in 2D textures, layered images, and reading back."""

from __future__ import annotations

import gpu
import numpy as np

from ..core.errors import InputError
from .elements import fill_elements

ROW = 4096  # elements per row: element i sits at (i & 4095, i >> 12), as data_lib.glsl reads it


def upload(data: np.ndarray, what: str, pixel: str = "RGBA32F") -> gpu.types.GPUTexture:
    """Texture of linear array ``data`` (…, 4), converted to float32; at least one element is stored.

    Raises:
        InputError: more elements than one texture holds; ``what`` names them in the message.
    """
    flat = np.ascontiguousarray(data, np.float32).reshape(-1, 4)
    rows = _rows(len(flat), what)
    if len(flat) < rows * ROW:
        padded = np.empty((rows * ROW, 4), np.float32)
        padded[: len(flat)], padded[len(flat) :] = flat, 0.0
        flat = padded
    buffer = gpu.types.Buffer("FLOAT", flat.size, flat.reshape(-1))
    return gpu.types.GPUTexture((ROW, rows), format=pixel, data=buffer)


def numbers(values: np.ndarray, what: str) -> gpu.types.GPUTexture:
    """``values`` (N,) as a linear array, one an element."""
    rows = _rows(len(values), what)
    padded = np.zeros(rows * ROW, np.float32)
    padded[: len(values)] = values
    return gpu.types.GPUTexture((ROW, rows), format="R32F", data=gpu.types.Buffer("FLOAT", padded.size, padded))


def scratch(elements: int, what: str, pixel: str = "RGBA32F") -> gpu.types.GPUTexture:
    """Linear array of ``elements`` without defined content, all of which is written before it is read."""
    return gpu.types.GPUTexture((ROW, _rows(elements, what)), format=pixel)


def allocate(elements: int, what: str, pixel: str = "RGBA32F") -> gpu.types.GPUTexture:
    """Linear array of ``elements`` zeros. That is a dispatch, so it cannot stand between another shader's bindings and
    its own: what is bound belongs to no shader."""
    texture = scratch(elements, what, pixel)
    fill_elements(texture, 0, texture.width * texture.height, 0.0, pixel)
    return texture


def allocate_integers(elements: int, what: str, value: int) -> gpu.types.GPUTexture:
    """Linear array of ``elements`` unsigned 32-bit integers, all of ``value``; see ``allocate``."""
    texture = scratch(elements, what, "R32UI")
    fill_elements(texture, 0, elements, value, "R32UI")
    return texture


def layers(width: int, height: int, count: int, pixel: str) -> gpu.types.GPUTexture:
    """Layered image without defined content."""
    return gpu.types.GPUTexture((width, height), layers=count, format=pixel)


def read(texture: gpu.types.GPUTexture, elements: int, channels: int = 4) -> np.ndarray:
    """(elements, channels) float32 copy of a linear array. Waits for the GPU."""
    buffer = texture.read()
    # Blender 4.5 and 5.0 export wrong strides for buffers of more than one dimension.
    buffer.dimensions = texture.width * texture.height * channels
    return np.frombuffer(buffer, np.float32).reshape(-1, channels)[:elements].copy()


def read_number(texture: gpu.types.GPUTexture) -> int:
    """The whole number in the first element of a small R32F ``texture``. Waits for the GPU."""
    buffer = texture.read()
    buffer.dimensions = texture.width * texture.height
    return int(buffer[0])


class GpuWait:
    """Called, returns when the GPU has done what it was told so far: commands are carried out in order. Whatever is
    bound stays bound. For many waits, of which the first takes ten times as long."""

    def __init__(self) -> None:
        self._mark: gpu.types.GPUTexture | None = None  # kept, as clearing a new one is what takes long

    def __call__(self) -> None:
        if self._mark is None:
            self._mark = gpu.types.GPUTexture((1, 1), format="R32F")
        self._mark.clear(format="FLOAT", value=(0.0,))  # what nothing was written to is read without waiting
        self._mark.read()


def wait_for_gpu() -> None:
    """Returns when the GPU has done what it was told so far."""
    GpuWait()()


def _rows(elements: int, what: str) -> int:
    limit = gpu.capabilities.max_texture_size_get()
    rows = max(1, -(-elements // ROW))
    if rows > limit:
        raise InputError(
            f"{elements} {what} do not fit the GPU, which holds {limit * ROW}; bake a smaller part of the scene"
        )
    return rows
