# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a test shader over linear arrays, so that each library of gpu_shaders/glsl can be asked directly."""

from functools import cache
from pathlib import Path

import gpu
import numpy as np
from gridlight.gpu_shaders import programs, textures
from gridlight.gpu_shaders.create_infos import NO_SURFACE

_HERE = Path(__file__).parent / "glsl"
_GROUP = 64


@cache
def _compile(name, libraries, samplers, layered, ints, defines):
    info = gpu.types.GPUShaderCreateInfo()
    for key, value in (("EXACT", "precise"), ("SHARED_", "shared"), ("NO_SURFACE", NO_SURFACE), *defines):
        info.define(key, value)
    for slot, sampler in enumerate(samplers):
        info.sampler(slot, "FLOAT_2D", sampler)
    for slot, sampler in enumerate(layered, len(samplers)):
        info.sampler(slot, "FLOAT_2D_ARRAY", sampler)
    info.image(0, "RGBA32F", "FLOAT_2D", "result", qualifiers={"WRITE"})
    for constant in (*ints, "count"):
        info.push_constant("INT", constant)
    info.local_group_size(_GROUP, 1, 1)
    sources = [programs._source(library) for library in libraries]
    info.compute_source("\n".join([*sources, (_HERE / f"{name}.glsl").read_text(encoding="utf-8")]))
    return gpu.shader.create_from_info(info)


def run(
    name, count, *, libraries=(), inputs=None, textures_2d=None, layered=None, ints=None, defines=None, elements=None
):
    """(elements, 4) float32 that ``glsl/NAME.glsl`` wrote for ``count`` threads, ``elements`` being ``count`` unless
    told.

    ``inputs`` are arrays (n, ≤4) uploaded as linear arrays, ``textures_2d`` and ``layered`` GPU textures by sampler
    name.
    """
    uploaded = {}
    for key, values in (inputs or {}).items():
        values = np.asarray(values, np.float32)
        padded = np.zeros((len(values), 4), np.float32)
        padded[:, : values.shape[1]] = values
        uploaded[key] = textures.upload(padded, "test input")
    samplers = {**uploaded, **(textures_2d or {})}
    layered, ints = layered or {}, ints or {}
    shader = _compile(
        name,
        tuple(libraries),
        tuple(samplers),
        tuple(layered),
        tuple(ints),
        tuple((key, str(value)) for key, value in (defines or {}).items()),
    )
    result = textures.allocate(elements or count, "test output")
    for key, texture in {**samplers, **layered}.items():
        shader.uniform_sampler(key, texture)
    shader.image("result", result)
    for key, value in {**ints, "count": count}.items():
        shader.uniform_int(key, (value,))
    gpu.compute.dispatch(shader, -(-count // _GROUP), 1, 1)
    return textures.read(result, elements or count)


def read_layers(texture, width, height, layers):
    """(layers, height, width, 4) float32 copy of a layered image; ``GPUTexture.read`` returns its first layer only."""
    count = width * height * layers
    values = run(
        "copy_layers",
        count,
        libraries=["data_lib"],
        layered={"source": texture},
        ints={"width": width, "height": height},
    )
    return values.reshape(layers, height, width, 4)
