# SPDX-License-Identifier: GPL-3.0-or-later
"""What ``verify`` measures: a probe file and two yardsticks against Cycles panoramas at the same points.

The yardsticks tell what is the bake's and what is the method's: a perfect probe with the file's bands standing at the
point itself (the floor), and perfect probes at the nodes with a plain trilinear lookup.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core import lookup, measures
from ..core import spherical_harmonics as sh
from ..core.errors import Cancelled, InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.panorama import panorama_irradiance, project_panorama
from ..core.snapshot import Light

_SEEDS = 1, 1_000_003  # panoramas take consecutive seeds from their first: the series never meet
_NODE_SEED = 2_000_003


@dataclass(frozen=True)
class Points:
    """Points of one kind; every point is asked for K irradiances.

    ``normals`` is (N, K, 3): six axes in free space, its own normal for a point on a surface. Points with ``nodes`` are
    probes that stand there and are asked what they hold; at others the file's lookup is asked.
    """

    name: str
    positions: np.ndarray  # (N, 3) world metres
    normals: np.ndarray
    nodes: np.ndarray | None = None  # (N,) grid indices


@dataclass(frozen=True)
class Row:
    """What was found at points of one kind. Irradiances are (N, K, 3)."""

    points: Points
    measured: np.ndarray  # by the probes or by the probe file's lookup
    reference: np.ndarray
    error: measures.ErrorFigures
    floor: measures.ErrorFigures  # of a perfect probe with the file's bands, standing at the point itself
    trilinear: measures.ErrorFigures | None  # of perfect probes at the nodes, plain trilinear lookup
    noise: float  # of the reference
    negative: measures.NegativeValues  # of ``measured``
    negative_floor: measures.NegativeValues  # what the bands alone bring below zero

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        worst = self.points.positions[self.error.worst_index]
        return {
            **self.error.as_dict(),
            "worst_position": [round(float(value), 6) for value in worst],
            "noise": self.noise,
            "floor": self.floor.as_dict(),
            "trilinear": self.trilinear.as_dict() if self.trilinear else None,
            "negative": {**self.negative.as_dict(), "floor": self.negative_floor.as_dict()},
        }


class Reference:
    """Cycles panoramas of ``scene``, whose world has ``suns``; says how far it is and stops where it is asked to.

    Raises:
        Cancelled: ``should_stop`` returned true between two panoramas.
    """

    def __init__(
        self, scene, samples: int, height: int, frame: int | None, reporter, should_stop, suns: Sequence[Light] = ()
    ):
        self._scene, self._samples, self._height, self._frame, self._suns = scene, samples, height, frame, suns
        self._reporter, self._should_stop = reporter, should_stop

    def panoramas(self, positions: np.ndarray, seed: int) -> np.ndarray:
        """(N, H, 2H, 3) radiance seen from ``positions`` (N, 3)."""
        from ..scene.cycles_reference import render_panoramas

        return render_panoramas(
            self._scene,
            positions,
            2 * self._height,
            self._height,
            self._samples,
            seed,
            suns=self._suns,
            frame=self._frame,
            progress=self._progress,
        )

    def _progress(self, _done: int, _total: int) -> None:
        self._reporter.advance(1)
        if self._should_stop():
            raise Cancelled()


def measure(field: Field, kinds: list[Points], reference: Reference, reporter, with_trilinear: bool) -> list[Row]:
    """Renders all points with two seeds and compares.

    Raises:
        Cancelled: see ``Reference``.
        InputError: a kind of points is black in the reference.
    """
    positions = np.concatenate([kind.positions for kind in kinds])
    nodes = _nodes_around(field.grid, positions) if with_trilinear else np.zeros(0, int)
    reporter.phase("Cycles", 2 * len(positions) + len(nodes))
    images = [reference.panoramas(positions, seed) for seed in _SEEDS]
    perfect = _perfect_probes(field, nodes, reference) if with_trilinear else None
    reporter.phase("compare")
    rows = []
    first = 0
    for kind in kinds:
        part = slice(first, first + len(kind.positions))
        first = part.stop
        rows.append(_compare(field, kind, images[0][part], images[1][part], perfect))
    return rows


def _compare(field: Field, kind: Points, first: np.ndarray, second: np.ndarray, perfect: np.ndarray | None) -> Row:
    """``first`` and ``second`` are (N, H, W, 3) panoramas of the same points with different seeds."""
    series = [
        np.stack([panorama_irradiance(image, normals) for image, normals in zip(images, kind.normals)])
        for images in (first, second)
    ]
    reference = np.mean(series, axis=0)
    if not reference.any():
        raise InputError(
            f"{kind.name}: Cycles sees no light at any of them; give the scene light before it is verified"
        )
    count = kind.normals.shape[1]
    if kind.nodes is not None:
        measured = sh.irradiance(field.coefficients[kind.nodes].astype(float)[:, None], kind.normals)
    else:
        measured = lookup.irradiance(field, np.repeat(kind.positions, count, axis=0), kind.normals.reshape(-1, 3))
        measured = measured.reshape(reference.shape)
    standing_there = np.stack([project_panorama((a + b) / 2, field.bands) for a, b in zip(first, second)])
    floor = sh.irradiance(standing_there[:, None], kind.normals)
    error = measures.compare(measured, reference)
    trilinear = None
    if perfect is not None:
        trilinear = measures.compare(_trilinear(field.grid, perfect, kind), reference)
    return Row(
        kind,
        measured,
        reference,
        error,
        measures.compare(floor, reference),
        trilinear,
        measures.noise_of_mean(*series),
        measures.count_negative(measured, error.scale),
        measures.count_negative(floor, error.scale),
    )


def _nodes_around(grid: Grid, positions: np.ndarray) -> np.ndarray:
    """Flat indices of the nodes that a trilinear lookup at ``positions`` (N, 3) reads."""
    nodes, weights = lookup.trilinear(grid, positions)
    return np.unique(nodes[weights > 0])


def _perfect_probes(field: Field, nodes: np.ndarray, reference: Reference) -> np.ndarray:
    """(P, bands², 3): what Cycles sees from ``nodes``, projected; zero elsewhere."""
    perfect = np.zeros((field.grid.count, field.bands**2, 3))
    images = reference.panoramas(field.grid.positions()[nodes], _NODE_SEED)
    perfect[nodes] = np.stack([project_panorama(image, field.bands) for image in images])
    return perfect


def _trilinear(grid: Grid, perfect: np.ndarray, kind: Points) -> np.ndarray:
    nodes, weights = lookup.trilinear(grid, kind.positions)
    blended = np.einsum("nw,nwkc->nkc", weights, perfect[nodes])
    return sh.irradiance(blended[:, None], kind.normals)
