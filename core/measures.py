# SPDX-License-Identifier: GPL-3.0-or-later
"""How far measured light is from a reference: the figures of ``verify``, of the measurements and of the tests.

With m the measured and r the reference values, N points, each with K values (normals × colours)::

    scale         R   = √ mean r²                                over all values
    point error   e_i = √( mean_k (m_ik − r_ik)² ) / R           what one point contributes
    relative RMS      = √ mean_i e_i² = √ mean (m − r)² / R
    bias              = mean (m − r) / R                          signed: > 0 is too bright
    percentile 95     = 95th percentile of e_i
    worst             = max e_i, at the point ``worst_index``

Everything is divided by the one R, never point by point: a dark corner must not turn a harmless difference into a
large error. A reference that is rendered twice with different seeds, a and b, and used as their mean carries an error
of its own,

    noise             = √ mean (a − b)² / (2 R)

which is part of the relative RMS (their squares add). An error near the noise says nothing more.

Irradiance below zero is counted over all values: how many of the N·K, and the most negative one over R. A truncated
series rings, so the basis alone has its share (core/ringing.py takes it away).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class ErrorFigures:
    """Errors relative to the RMS of the reference; see the module for the formulas. ``scale`` is that RMS, in the
    values' unit."""

    relative_rms: float
    bias: float
    percentile_95: float
    worst: float
    worst_index: int
    points: int
    scale: float

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        return asdict(self)


def compare(measured: np.ndarray, reference: np.ndarray, scale: float | None = None) -> ErrorFigures:
    """Figures of ``measured`` against ``reference``, both (N, …) with one entry per point, N ≥ 1.

    Args:
        scale: R where it comes from elsewhere, as for the light that leaks into a dark room from a lit one.

    Raises:
        ValueError: the shapes differ, there is no point, or all reference values are zero and no scale is given.
    """
    measured, reference = np.asarray(measured, float), np.asarray(reference, float)
    if measured.shape != reference.shape or not len(reference):
        raise ValueError(f"cannot compare arrays of shapes {measured.shape} and {reference.shape}")
    if scale is None:
        scale = root_mean_square(reference)
    if not scale > 0:
        raise ValueError("the reference is zero everywhere: there is nothing to relate an error to")
    errors, biases = point_errors(measured, reference, scale)
    worst = int(np.argmax(errors))
    return ErrorFigures(
        relative_rms=root_mean_square(errors),
        bias=float(biases.mean()),
        percentile_95=float(np.percentile(errors, 95)),
        worst=float(errors[worst]),
        worst_index=worst,
        points=len(reference),
        scale=float(scale),
    )


def point_errors(measured: np.ndarray, reference: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """(N,) errors e_i and (N,) signed biases of each point relative to ``scale``; arrays as for ``compare``."""
    difference = (np.asarray(measured, float) - np.asarray(reference, float)).reshape(len(reference), -1) / scale
    return np.sqrt((difference**2).mean(axis=1)), difference.mean(axis=1)


def noise_of_mean(first: np.ndarray, second: np.ndarray) -> float:
    """Relative RMS error of the mean of two independent renders of the same values; 0 where both are zero
    everywhere."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    scale = root_mean_square((first + second) / 2)
    return root_mean_square(first - second) / (2 * scale) if scale > 0 else 0.0


@dataclass(frozen=True)
class NegativeValues:
    """How many of ``values`` are below zero, and the lowest relative to the reference's scale (0 where none is)."""

    count: int
    values: int
    lowest: float

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        return asdict(self)


def count_negative(measured: np.ndarray, scale: float) -> NegativeValues:
    """Counts values of ``measured`` (any shape) below zero; ``scale`` is R."""
    measured = np.asarray(measured, float)
    return NegativeValues(int((measured < 0).sum()), measured.size, float(min(measured.min(initial=0.0), 0.0)) / scale)


def root_mean_square(values: np.ndarray) -> float:
    """√ mean v² over all values."""
    return float(np.sqrt(np.mean(np.square(np.asarray(values, float)))))
