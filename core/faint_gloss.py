# SPDX-License-Identifier: GPL-3.0-or-later
"""Gloss that is too weak or too broad to be followed: sent in all directions, but not evenly.

What facets mirror grows towards grazing views, and what they leave to the diffuse part shrinks. Under light that is the
same from everywhere a surface of albedo A of which S is mirrored (core/gloss.py) sends to a view at the angle θ

    A(θ) = F + (A − S)(1 − F)/(1 − S),    F = S · (1 + k·((1 − cos θ)ᵖ − m)),    m = 2 / ((p + 1)(p + 2))

where m is the mean of (1 − cos θ)ᵖ over all directions, so that A(θ) has the mean A. Of light that arrives at an angle
θ facets mirror as much as they would send that way, so it counts

    C(θ) = 1 + k · S/A · ((1 − cos θ)ᵖ − m),

on average again 1. What is sent is A(θ)/π times the irradiance so weighted. One ray a patch asks what surface it lies
on; no light is lost or made. A lamp overhead counts 2.5 % less in a room of white plastic than one that is everywhere.

M materials, N places; a coupling is (k · S/A per channel, p). Readable twin of surface_lib.glsl and coupling_lib.glsl.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .gloss import DIELECTRIC, NO_GLOSS, Gloss

# How what facets mirror grows (core/gloss.py), over those that a view at the angle θ sees, is about s·(1 − cos θ)ᵖ: s
# and p by roughness, fitted to what core/gloss.py draws; of dielectrics to what leaves after one reflection, as Cycles
# gives nothing back to those of what is lost between facets, most of it at grazing angles.
_ROUGHNESS = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0])
_GRAZING = np.array([0.979, 0.933, 0.718, 0.485, 0.314, 0.206, 0.138, 0.071, 0.043])
_POWER = np.array([4.82, 4.64, 3.94, 3.32, 2.94, 2.76, 2.66, 2.68, 2.78])
_DIELECTRIC_GRAZING = np.array([0.874, 0.827, 0.628, 0.421, 0.278, 0.193, 0.150, 0.132, 0.177])
_DIELECTRIC_POWER = np.array([4.40, 4.24, 3.62, 3.04, 2.68, 2.52, 2.50, 2.44, 2.32])


def faint_rows(glosses: Sequence[Gloss | None]) -> np.ndarray:
    """(M, 3, 4) float32 elements of surface_lib's ``faint_gloss``: share of what is sent back, p | k, whether the
    share is one of the light instead | what facets mirror that are seen face on, their width α."""
    rows = np.zeros((max(len(glosses), 1), 3, 4), np.float32)
    for row, gloss in zip(rows, glosses):
        gloss = gloss or NO_GLOSS
        facing = np.array(gloss.facing)
        dielectric = facing.max() < DIELECTRIC
        power = np.interp(gloss.roughness, _ROUGHNESS, _DIELECTRIC_POWER if dielectric else _POWER)
        grazing = np.interp(gloss.roughness, _ROUGHNESS, _DIELECTRIC_GRAZING if dielectric else _GRAZING)
        row[0] = (*gloss.share, power)
        row[1, :3] = (1 - facing) * grazing / (facing + (1 - facing) * grazing * _mean(power))
        row[1, 3] = gloss.fixed
        row[2] = (*gloss.facing, gloss.roughness**2)
    return rows


def albedo_towards(rows: np.ndarray, albedo: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """(N, 3) A(θ) of places of ``albedo`` (N, 3) and ``rows`` (N, 3, 4), seen at ``cosine`` (N,)."""
    whole, mirrored = mirrored_at(rows, albedo), mirrored_at(rows, albedo, cosine)
    return mirrored + (albedo - whole) * (1 - mirrored) / np.maximum(1 - whole, 1e-3)


def mirrored_at(rows: np.ndarray, albedo: np.ndarray, cosine: np.ndarray | None = None) -> np.ndarray:
    """(N, 3) F of places of ``albedo`` (N, 3) and ``rows`` (N, 3, 4) at ``cosine`` (N,); S without one."""
    whole = _whole(rows, albedo)
    if cosine is None:
        return whole
    return np.minimum(whole * (1 + rows[:, 1, :3] * _grazing(cosine, rows[:, 0, 3])), 1.0)


def couplings(rows: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """(N, 4) couplings of places of ``albedo`` (N, 3) and ``rows`` (N, 3, 4)."""
    strength = rows[:, 1, :3] * _whole(rows, albedo) / np.maximum(albedo, 1e-9)
    return np.concatenate([strength, rows[:, 0, 3:]], axis=1)


def coupled(coupling: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """(N, 3) C(θ) of places with ``coupling`` (N, 4) for light that arrives at ``cosine`` (N,)."""
    return 1 + coupling[:, :3] * _grazing(cosine, coupling[:, 3])


def _whole(rows: np.ndarray, albedo: np.ndarray) -> np.ndarray:
    """(N, 3) S above."""
    return np.where(rows[:, 1, 3:] > 0, np.minimum(rows[:, 0, :3], albedo), albedo * rows[:, 0, :3])


def _grazing(cosine: np.ndarray, power: np.ndarray) -> np.ndarray:
    return (np.clip(1 - cosine, 0, 1) ** power - _mean(power))[:, None]


def _mean(power):
    return 2 / ((power + 1) * (power + 2))
