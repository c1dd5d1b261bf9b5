# SPDX-License-Identifier: GPL-3.0-or-later
"""Elements of linear arrays on the GPU, copied and set."""

from __future__ import annotations

import gpu

from .dispatch import dispatch_linear
from .programs import program


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
    pixel: str = "R32F",
    factor: tuple[gpu.types.GPUTexture, int] | None = None,
) -> None:
    """Sets all channels of ``count`` elements of ``target`` from ``first`` on to ``value``, times an element of another
    array if that is given as ``factor``: array and index. A sixth of the time that clearing a texture takes GPUs."""
    integers = pixel == "R32UI"
    kind = "UINT_2D" if integers else "FLOAT_2D"
    shader = program("fill_elements_comp", PIXEL=pixel, KIND=kind, INTEGERS=integers, TIMES=factor is not None)
    shader.image("target", target)
    if factor is not None:
        shader.uniform_sampler("factors", factor[0])
        shader.uniform_int("factor", (factor[1],))
    shader.uniform_int("first", (first,))
    shader.uniform_int("count", (count,))
    if integers:
        shader.uniform_int("value", (int(value) - (int(value) >> 31 << 32),))  # Python's binding takes signed ones
    else:
        shader.uniform_float("value", value)
    dispatch_linear(shader, count)
