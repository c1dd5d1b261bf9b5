# SPDX-License-Identifier: GPL-3.0-or-later
"""Seeded numbers and what they are turned into: the readable twin of gpu_shaders/glsl/random_lib.glsl.

A number depends on what is sampled (patch, light, sample) and on nothing else, so any split of the work gives the same
light.
"""

from __future__ import annotations

import numpy as np

# Steps of Roberts' R2 sequence times 2³²: 1/ρ and 1/ρ² of the plastic number ρ, the real root of ρ³ = ρ + 1.
R2_STEP = np.array([3242174889, 2447445414], np.uint32)
# The same in three dimensions: ρ⁴ = ρ + 1.
R3_STEP = np.array([3518319155, 2882110345, 2360945575], np.uint32)


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


def sample_r2(keys: np.ndarray, index: int | np.ndarray) -> np.ndarray:
    """(…, 2) float32 numbers in [0, 1): sample ``index`` (one or …) of the sequence that belongs to each of ``keys``
    (…, 3) uint32.

    The R2 sequence, two-dimensional and of low discrepancy, shifted by the hash modulo 1 (Cranley and Patterson 1976),
    in integers whose overflow is the modulo: the shader's numbers to the last bit.
    """
    return _sequence(pcg3d(keys)[..., :2], R2_STEP, index)


def sample_r3(keys: np.ndarray, index: int | np.ndarray) -> np.ndarray:
    """(…, 3) numbers likewise."""
    return _sequence(pcg3d(keys), R3_STEP, index)


def _sequence(start: np.ndarray, step: np.ndarray, index: int | np.ndarray) -> np.ndarray:
    place = start + step * np.asarray(index).astype(np.uint32)[..., None]
    return (place >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def keys_of(items: np.ndarray, stream: int, seed: int) -> np.ndarray:
    """(…, 3) uint32 keys of the numbers that ``items`` (…), patches or texels or probes, take for one purpose,
    ``stream``."""
    items = np.asarray(items).astype(np.uint32)
    return np.stack([items, np.full_like(items, stream), np.full_like(items, seed)], axis=-1)


def shifted(keys: np.ndarray, *by: int) -> np.ndarray:
    """``keys`` (…, 3) plus three whole numbers, modulo 2³²."""
    return keys + np.array([number & 0xFFFFFFFF for number in by], np.uint32)


class WeightedChoice:
    """One of several things for each of N, in proportion to weights that come one after the other, by a single number
    ``u`` (N,) in [0, 1): what is left of it is spread over 0..1 again each time."""

    def __init__(self, u: np.ndarray):
        self._number = u.astype(float)
        self.total = np.zeros(len(u))  # of all weights
        self.weight = np.zeros(len(u))  # of what is chosen

    def takes(self, weight: np.ndarray) -> np.ndarray:
        """(N,) bool: does the choice move on to the next thing, of ``weight`` (N,), not negative?"""
        self.total += weight
        number, total = self._number, self.total
        taken = (weight > 0) & (number * total < weight)
        left = ~taken & (total > weight)
        number[taken] *= total[taken] / weight[taken]
        number[left] = (number[left] * total[left] - weight[left]) / (total[left] - weight[left])
        self.weight[taken] = weight[taken]
        return taken


def light_keys(keys: np.ndarray, light: int) -> np.ndarray:
    """Keys of the places on light number ``light``; the odd factor keeps lights apart for any seed."""
    return shifted(keys, 0, 0, light * 0x9E3779B9)


def sample_disk(u: np.ndarray) -> np.ndarray:
    """(N, 2) points spread evenly over the unit disk by numbers ``u`` (N, 2) in [0, 1)."""
    radius, angle = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def tangent_frame(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors perpendicular to each of ``n`` (N, 3): Duff et al., "Building an Orthonormal Basis, Revisited",
    JCGT 2017."""
    x, y, z = n.T
    s = np.where(z >= 0, 1.0, -1.0)
    a = -1.0 / (s + z)
    c = x * y * a
    return np.stack([1 + s * x * x * a, s * c, -s * x], 1), np.stack([c, s + y * y * a, -y], 1)


def sample_cosine(normals: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(N, 3) unit directions of density cos θ/π about ``normals`` (N, 3) by ``u`` (N, 2) in [0, 1): Malley's method,
    the unit disk raised to the half sphere."""
    tangent, bitangent = tangent_frame(normals)
    disk = sample_disk(u)
    height = np.sqrt(np.maximum(1.0 - u[:, :1], 0.0))
    directions = disk[:, :1] * tangent + disk[:, 1:] * bitangent + height * normals
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)
