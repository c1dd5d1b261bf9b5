# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded numbers of shadow samples: the readable twin of gpu_shaders/glsl/random_lib.glsl.

A number depends on what is sampled (probe, texel, light, sample) and on nothing else, so any split of the work gives
the same light.
"""

from __future__ import annotations

import numpy as np

# Steps of Roberts' R2 sequence times 2³²: 1/ρ and 1/ρ² of the plastic number ρ, the real root of ρ³ = ρ + 1.
R2_STEP = np.array([3242174889, 2447445414], np.uint32)


def pcg3d(keys: np.ndarray) -> np.ndarray:
    """Hash of ``keys`` (…, 3) uint32 to (…, 3) uint32, arithmetic modulo 2³².

    Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020, listing 16.
    """
    v = np.asarray(keys, np.uint32) * np.uint32(1664525) + np.uint32(1013904223)
    v = _mix(v)
    v ^= v >> np.uint32(16)
    return _mix(v)


def _mix(v: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(v, -1, 0)
    x = x + y * z
    y = y + z * x
    z = z + x * y
    return np.stack([x, y, z], axis=-1)


def sample_r2(keys: np.ndarray, index: int) -> np.ndarray:
    """(…, 2) float32 numbers in [0, 1): sample ``index`` of the sequence that belongs to each of ``keys`` (…, 3)
    uint32.

    The R2 sequence, two-dimensional and of low discrepancy, shifted by the hash modulo 1 (Cranley and Patterson 1976),
    in integers whose overflow is the modulo: the shader's numbers to the last bit.
    """
    place = pcg3d(keys)[..., :2] + R2_STEP * np.uint32(index)
    return (place >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def texel_keys(nodes: np.ndarray, texels: np.ndarray, stream: int, seed: int) -> np.ndarray:
    """(…, 3) uint32 keys of the samples that texels (…) of probes at grid ``nodes`` (…) take for one purpose,
    ``stream``.

    ``texels`` count face by face, row by row.
    """
    last = np.uint32((stream + seed) & 0xFFFFFFFF)
    nodes, texels = np.broadcast_arrays(np.asarray(nodes, np.uint32), np.asarray(texels, np.uint32))
    return np.stack([nodes, texels, np.full_like(nodes, last)], axis=-1)


PLACE_STREAM = 0x632BE5AB  # where in its footprint a texel looks


def light_stream(light: int) -> int:
    """Where on light number ``light`` a shadow ray goes; the odd factor keeps lights apart for any seed."""
    return light * 0x9E3779B9
