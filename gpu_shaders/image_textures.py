# SPDX-License-Identifier: GPL-3.0-or-later
"""The images of a scene with their mip levels, as surface_lib.glsl reads them: half floats in one linear array."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import gpu
import numpy as np

from ..core.snapshot import Image
from .dispatch import dispatch_linear
from .programs import program
from .textures import ROW, allocate, upload

_EXTENSIONS = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3, "ATLAS": 4}


@dataclass(frozen=True, eq=False)
class ImageTextures:
    """``images`` on the GPU. Nothing of it changes, so scenes of the same images share it."""

    images: list[Image]
    table: gpu.types.GPUTexture
    texels: gpu.types.GPUTexture


_last: list[weakref.ref[ImageTextures]] = []  # sent, as long as a scene has them


def kept_or_sent(images: list[Image]) -> ImageTextures:
    """``images``, as another scene has them if they are its very pixels."""
    last = _last[0]() if _last else None
    if last is not None and len(last.images) == len(images) and all(map(_same, last.images, images)):
        return last
    textures = ImageTextures(images, *_send_all(images))
    _last[:] = [weakref.ref(textures)]
    return textures


def _same(one: Image, other: Image) -> bool:
    return one.pixels is other.pixels and one.extension == other.extension


def _send_all(images: list[Image]) -> tuple[gpu.types.GPUTexture, gpu.types.GPUTexture]:
    """Table of ``images`` and their texels: each image starts a row, its mip levels follow one another.

    Raises:
        InputError: more texels than one texture holds.
    """
    table = np.zeros((len(images), 4), np.float32)
    row, rows = 0, []
    for entry, image in zip(table, images):
        height, width = image.pixels.shape[:2]
        entry[:] = row, width, height, _EXTENSIONS[image.extension]
        rows.append(-(-sum(w * h for w, h in _levels(width, height)) // ROW))
        row += rows[-1]
    texels = allocate(row * ROW, "image texels", "RGBA16F")
    for entry, image, count in zip(table, images, rows):
        _send(image, texels, int(entry[0]) * ROW, count * ROW)
    return upload(table, "images"), texels


def _send(image: Image, halves: gpu.types.GPUTexture, first: int, count: int) -> None:
    """``image`` and its mip levels to ``count`` elements of ``halves`` from ``first`` on."""
    height, width = image.pixels.shape[:2]
    padded = np.empty((count, 4), np.float32)
    padded[: width * height] = np.asarray(image.pixels, np.float32).reshape(-1, 4)
    padded[width * height :] = 0.0
    texels = upload(padded, "image texels")
    levels, start = _levels(width, height), 0
    for before, level in zip(levels, levels[1:]):
        shader = program("image_mip_comp")
        shader.image("texels", texels)
        for name, value in (
            ("before_start", start),
            ("before_width", before[0]),
            ("before_height", before[1]),
            ("start", start + before[0] * before[1]),
            ("width", level[0]),
            ("height", level[1]),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, level[0] * level[1])
        start += before[0] * before[1]
    shader = program("image_store_comp")
    shader.uniform_sampler("texels", texels)
    shader.image("halves", halves)
    shader.uniform_int("first", (first,))
    shader.uniform_int("count", (count,))
    dispatch_linear(shader, count)


def _levels(width: int, height: int) -> list[tuple[int, int]]:
    """Width and height of each mip level, halved and rounded down, never below 1."""
    levels = [(width, height)]
    while max(levels[-1]) > 1:
        levels.append((max(levels[-1][0] // 2, 1), max(levels[-1][1] // 2, 1)))
    return levels
