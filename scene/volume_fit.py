# SPDX-License-Identifier: GPL-3.0-or-later
"""A probe volume for a scene that has none: where an artist would have put it.

1. Backdrops are left out: a flat object (a ground plane) more than twice as large as everything smaller together, an
   object that only emits (a sky dome) more than five times as large, a low one (a terrain) more than ten times as
   large. Anything else is a room, however little stands in it.
2. Stragglers are left out: along every axis the volume ends where all but 0.1 % of the surface area lies, unless the
   rest is near, which means within a quarter of that core.
3. Backdrops come back a little: around what stands on them a tenth of the core's diagonal, as far as they reach.
4. Probes stand in the middle of cells that divide these bounds evenly, plus one layer outside. So no probe lies in a
   wall that bounds the scene, and every surface has probes on both sides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.errors import InputError
from ..core.grid import Grid
from ..core.settings import MAX_RESOLUTION
from ..core.snapshot import NO_IMAGE, SceneSnapshot

_FLAT_BACKDROP, _SKY_BACKDROP, _LOW_BACKDROP = 2.0, 5.0, 10.0  # size against all that is smaller
_FLAT, _LOW = 0.02, 0.15  # thickness against size
_STRAGGLING_AREA = 0.001  # share of the surface area that may lie outside, per side
_NEAR = 0.25  # of the core's extent
_BACKDROP_MARGIN = 0.1  # of the core's diagonal
_PROBES = 1000  # about so many nodes inside the bounds by default
_ROUND_STEPS = np.array([1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


def fit_volume(snapshot: SceneSnapshot, spacing: float | None = None, resolution: Sequence[int] | None = None) -> Grid:
    """An axis-aligned grid around what matters in ``snapshot``.

    Args:
        spacing: metres between probes; by default a round figure that gives about a thousand probes within the bounds,
            which for a room is half a metre to a metre. With the layer outside there are up to three times as many.
        resolution: probes per axis instead of a spacing.

    Raises:
        InputError: the scene has no surface, or the options are out of range.
    """
    low, high, _ = fitted_bounds(snapshot)
    if spacing is not None and not (np.isfinite(spacing) and spacing > 0):
        raise InputError(f"--spacing is {spacing}; it must be a length in metres greater than 0")
    size = high - low
    if resolution is None:
        step = spacing or default_spacing(size)
        cells = np.clip(np.rint(size / step), 1, MAX_RESOLUTION - 2).astype(int)
        cells[size < step * 1e-3] = 0
        cell_size = np.where(cells > 0, size / np.maximum(cells, 1), step)
        counts = cells + 2
    else:
        counts = np.array([int(count) for count in resolution])
        inner = np.maximum(counts - 2, 1)
        # One or two probes along an axis leave no room for a layer outside: the box ends with the scene.
        cell_size = np.where(counts > 2, size / inner, 0.0)
        flat = size + cell_size <= 0
        cell_size[flat] = max(size.max(), 1.0) * 0.1
    return Grid.from_bounds(low - cell_size / 2, high + cell_size / 2, counts, "fitted volume")


def fitted_bounds(snapshot: SceneSnapshot) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """World-space (low, high), (3,) each, of what matters in the scene, and the names of the objects left out of it.

    Raises:
        InputError: the scene has no surface.
    """
    if not len(snapshot.triangles):
        raise InputError(
            f"scene '{snapshot.name}' has no surface that renders show; add a mesh or give --min and --max"
        )
    corners = snapshot.triangle_positions
    lows, highs, present = _object_bounds(snapshot, corners)
    kept = _without_backdrops(snapshot, lows, highs, present)
    inside = kept[snapshot.object_index]
    low, high = _core(corners[inside])
    if not kept[present].all():
        margin = _BACKDROP_MARGIN * np.linalg.norm(high - low)
        low = np.maximum(low - margin, lows[present].min(axis=0))
        high = np.minimum(high + margin, highs[present].max(axis=0))
    outside = present & ((lows > high).any(axis=1) | (highs < low).any(axis=1) | ~kept)
    return low, high, [snapshot.object_names[index] for index in np.flatnonzero(outside)]


def default_spacing(size: np.ndarray) -> float:
    """Metres between probes so that a box of ``size`` (3,) holds about a thousand, as a round figure."""
    usable = np.maximum(size, 0.05 * size.max())
    step = (usable.prod() / _PROBES) ** (1 / 3)
    magnitude = 10.0 ** np.floor(np.log10(step))
    return float(magnitude * _ROUND_STEPS[np.argmin(np.abs(_ROUND_STEPS - step / magnitude))])


def _object_bounds(snapshot: SceneSnapshot, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Per object (O, 3) low and high, and (O,) whether it has triangles."""
    count = len(snapshot.object_names)
    lows, highs = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    starts = np.flatnonzero(np.diff(snapshot.object_index, prepend=-1))  # triangles of one object are consecutive
    owners = snapshot.object_index[starts]
    np.minimum.at(lows, owners, np.minimum.reduceat(corners.min(axis=1), starts, axis=0))
    np.maximum.at(highs, owners, np.maximum.reduceat(corners.max(axis=1), starts, axis=0))
    return lows, highs, np.isfinite(lows).all(axis=1)


def _without_backdrops(snapshot, lows, highs, present) -> np.ndarray:
    """(O,) bool: objects that are not a backdrop for the others."""
    kept = present.copy()
    sizes = np.where(present, np.linalg.norm(np.where(present[:, None], highs - lows, 0), axis=1), 0)
    order = np.argsort(-sizes)
    # Bounds of everything from each place in the order on, so that each step knows the rest's size.
    rest_low = np.minimum.accumulate(lows[order][::-1], axis=0)[::-1]
    rest_high = np.maximum.accumulate(highs[order][::-1], axis=0)[::-1]
    emitters = _only_emitting(snapshot)
    for place, item in enumerate(order[: int(present.sum()) - 1]):
        rest = np.linalg.norm(rest_high[place + 1] - rest_low[place + 1])
        thickness = (highs[item] - lows[item]).min() / sizes[item]
        limit = (
            _FLAT_BACKDROP
            if thickness < _FLAT
            else _SKY_BACKDROP
            if item in emitters
            else _LOW_BACKDROP
            if thickness < _LOW
            else np.inf
        )
        if sizes[item] <= limit * rest:
            break
        kept[item] = False
    return kept


def _only_emitting(snapshot: SceneSnapshot) -> set[int]:
    """Objects whose every material emits and reflects nothing."""
    emitting = np.array(
        [
            (any(material.emission) or material.emission_image != NO_IMAGE) and not any(material.base_color)
            for material in snapshot.materials
        ],
        bool,
    )
    reflecting = np.unique(snapshot.object_index[~emitting[snapshot.material_index]])
    return set(np.unique(snapshot.object_index).tolist()) - set(reflecting.tolist())


def _core(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(low, high) without the far stragglers; ``corners`` is (T, 3, 3)."""
    edges = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    weights = np.repeat(areas / 3, 3)
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        values = corners[..., axis].ravel()
        order = np.argsort(values)
        share = np.cumsum(weights[order])
        first, last = np.searchsorted(share, np.array([_STRAGGLING_AREA, 1 - _STRAGGLING_AREA]) * share[-1])
        core_low, core_high = values[order[first]], values[order[min(last, len(order) - 1)]]
        reach = _NEAR * (core_high - core_low)
        true_low, true_high = values[order[0]], values[order[-1]]
        low[axis] = true_low if core_low - true_low <= reach else core_low
        high[axis] = true_high if true_high - core_high <= reach else core_high
    return low, high
