# SPDX-License-Identifier: GPL-3.0-or-later
"""What every compute dispatch costs and how much memory it is given, for measurements.

While a profile is on, the GPU is waited for before and after every dispatch, so that each one's time is its own. That
makes the whole slower: its own wait is part of every dispatch's time (``limits`` says how long an empty one takes).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import gpu
import numpy as np

from . import programs
from .textures import GpuWait

_ENOUGH_SECONDS = 0.5
_BYTES = {"RGBA32F": 16, "RG32F": 8, "R32F": 4, "RGBA16F": 8, "R32UI": 4, "R32I": 4}


@dataclass
class DispatchCost:
    """Sums over all dispatches of one shader. ``bytes``: of all arrays and images that it was given, each once."""

    dispatches: int = 0
    seconds: float = 0.0
    bytes: int = 0
    groups: int = 0


class _Observed:
    """A shader that notes what it is given."""

    def __init__(self, name: str, shader: gpu.types.GPUShader):
        self.name, self.shader = name, shader
        self.textures: dict[str, gpu.types.GPUTexture] = {}

    def uniform_sampler(self, name: str, texture) -> None:
        self.textures[name] = texture
        self.shader.uniform_sampler(name, texture)

    def image(self, name: str, texture) -> None:
        self.textures[name] = texture
        self.shader.image(name, texture)

    def __getattr__(self, name: str):
        return getattr(self.shader, name)


@contextmanager
def profiled(layers: dict[str, int]) -> Iterator[dict[str, DispatchCost]]:
    """Costs by shader of all compute dispatches inside the block. ``layers``: how many the images of these names have;
    Blender does not tell."""
    costs: dict[str, DispatchCost] = {}
    dispatch, wait_for_gpu = gpu.compute.dispatch, GpuWait()

    def observe(name: str, shader):
        return _Observed(name, shader) if name.endswith("_comp") else shader

    def timed(shader, x: int, y: int, z: int) -> None:
        if not isinstance(shader, _Observed):
            dispatch(shader, x, y, z)
            return
        wait_for_gpu()
        start = time.perf_counter()
        dispatch(shader.shader, x, y, z)
        wait_for_gpu()
        cost = costs.setdefault(shader.name, DispatchCost())
        cost.seconds += time.perf_counter() - start
        cost.dispatches += 1
        cost.groups += x * y * z
        cost.bytes += sum(_size(texture) * layers.get(name, 1) for name, texture in shader.textures.items())

    programs.observer, gpu.compute.dispatch = observe, timed
    try:
        yield costs
    finally:
        programs.observer, gpu.compute.dispatch = None, dispatch


def _size(texture: gpu.types.GPUTexture) -> int:
    return texture.width * texture.height * _BYTES.get(texture.format, 4)


@dataclass(frozen=True)
class DeviceLimits:
    """What the device reaches with nothing else to do."""

    copy_bytes_per_second: float  # read and written
    operations_per_second: float  # float32 multiplications and additions
    wait_seconds: float  # for a dispatch that does next to nothing


def limits() -> DeviceLimits:
    """Measures the device; takes a tenth of a second to a second."""
    edge = 2048
    texels = [gpu.types.GPUTexture((edge, edge), format="RGBA32F") for _ in range(2)]
    for texture in texels:
        texture.clear(format="FLOAT", value=(1.0, 1.0, 1.0, 1.0))
    copy, arithmetic = programs.program("measure_copy_comp"), programs.program("measure_arithmetic_comp")
    copies = 4

    def copying(times: int) -> None:
        for index in range(times):
            copy.uniform_sampler("from_texels", texels[index % 2])
            copy.image("to_texels", texels[1 - index % 2])
            gpu.compute.dispatch(copy, edge // 16, edge // 16, 1)

    def computing(rounds: int, width: int = edge) -> None:
        arithmetic.image("to_texels", texels[0])
        arithmetic.uniform_int("rounds", (rounds,))
        arithmetic.uniform_float("factor", 0.99)
        gpu.compute.dispatch(arithmetic, width // 16, width // 16, 1)

    nothing = _seconds(lambda: computing(0, 16))
    rounds = 16
    while (spent := _seconds(lambda: computing(rounds), 1) - nothing) < 0.02 and rounds < 1 << 16:
        rounds *= 2
    spent = _seconds(lambda: computing(rounds), 3) - nothing
    return DeviceLimits(
        copy_bytes_per_second=32.0 * edge * edge * copies / (_seconds(lambda: copying(copies)) - nothing),
        operations_per_second=32.0 * rounds * edge * edge / spent,
        wait_seconds=nothing,
    )


def _seconds(work, most: int = 7) -> float:
    """Median seconds of ``work`` on the GPU; slow devices repeat less."""
    wait_for_gpu = GpuWait()
    work()
    wait_for_gpu()
    times: list[float] = []
    while not times or (len(times) < most and sum(times) < _ENOUGH_SECONDS):
        start = time.perf_counter()
        work()
        wait_for_gpu()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
