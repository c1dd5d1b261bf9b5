# SPDX-License-Identifier: GPL-3.0-or-later
"""From the outcomes of all blocks to the field of the grid: what needs neighbours across blocks, on the CPU.

Needs neither Blender nor a GPU, so the shards of a farm are merged by the same code.
"""

from __future__ import annotations

import numpy as np

from ..core import dilation, gradients
from ..core.conventions import ACTIVE, CULLED, INVALID
from ..core.errors import InputError
from ..core.field import Field, state_counts
from ..core.grid import Grid
from ..core.open_air import OPEN
from ..core.orientation import inside_solid
from ..core.settings import BakeSettings
from .deringing import dering_field
from .outcome import BlockOutcome
from .result import BakeResult

_MOST_NAMED = 8  # probes
_AT_HOME = 1e-5  # cells: steps are rounded


def complete(
    result: BakeResult,
    grid: Grid,
    settings: BakeSettings,
    state: np.ndarray,
    offset: np.ndarray,
    outcomes: list[BlockOutcome],
    scene_name: str,
) -> None:
    """Fills field, counts, warnings and notes of ``result`` from ``outcomes`` of the blocks that hold active probes.

    Args:
        state: (P,) before capture, see ``cull``; active probes that no outcome holds become invalid.
        offset: (P, 3) metres by which the user moved probes.

    Raises:
        InputError: the light is not finite.
    """
    nodes = np.concatenate([np.zeros(0, np.int64), *(outcome.nodes for outcome in outcomes)])
    shares = np.concatenate([np.zeros((0, 4), np.float32), *(outcome.shares for outcome in outcomes)])
    inside = inside_solid(shares)
    states = np.where(state == OPEN, CULLED, state).astype(np.uint8)
    states[(state == ACTIVE) & ~np.isin(np.arange(grid.count), nodes)] = INVALID
    if len(inside) and inside.all():
        result.warnings.append(
            f"{grid.name}: every probe sees mostly back faces without light; they are baked all the same. "
            "Flip the normals of what surrounds the volume, or move it out of solid geometry"
        )
    else:
        states[nodes[inside & (state[nodes] == ACTIVE)]] = INVALID
    _warn_of_hollows(result, grid, states, outcomes)
    field = result.field = Field.empty(grid, settings.bands)
    field.state[:] = states
    field.offset[:] = offset
    for outcome in outcomes:
        field.validity[outcome.nodes] = 1.0 - outcome.shares[:, 0]
        field.offset[outcome.nodes] = outcome.offset
        field.coefficients[outcome.nodes] = outcome.coefficients
        field.depth[outcome.nodes] = outcome.depth
        field.gradient[outcome.nodes] = outcome.gradient
    # Culled probes that turned out to stand in or behind something: as if they had not captured.
    astray = inside | (
        np.abs(field.offset - offset)[nodes].max(axis=1, initial=0.0) > _AT_HOME * grid.cell_size().min()
    )
    buried = nodes[(state[nodes] == OPEN) & astray]
    field.depth[buried], field.validity[buried], field.offset[buried] = 0.0, 1.0, offset[buried]
    field.coefficients = dilation.fill(grid, field.coefficients, field.holds_light)
    field.gradient[~field.holds_light] = 0.0
    field.gradient = gradients.limited(grid, field.gradient, field.coefficients, states == ACTIVE)
    if settings.deringing:
        result.notes.append(dering_field(field))
    result.counts = state_counts(states)
    if not np.isfinite(field.coefficients).all():
        raise InputError(
            f"scene '{scene_name}' sends light that is not finite; look for lights or emission beyond 1e30"
        )


def _warn_of_hollows(result: BakeResult, grid: Grid, states: np.ndarray, outcomes: list[BlockOutcome]) -> None:
    hollow = np.sort(np.concatenate([np.zeros(0, np.int64), *(outcome.hollow for outcome in outcomes)]))
    hollow = hollow[states[hollow] == ACTIVE]
    if not len(hollow):
        return
    named = ", ".join(str(grid.coordinates(node)) for node in hollow[:_MOST_NAMED])
    more = f" and {len(hollow) - _MOST_NAMED} more" if len(hollow) > _MOST_NAMED else ""
    result.warnings.append(
        f"{grid.name}: {len(hollow)} of {(states == ACTIVE).sum()} probes stand in closed hollows that light hardly "
        f"gets into or out of; they show it after {result.iterations - 1} bounces, not settled: {named}{more}. Where "
        "that matters darken what is nearly white in there, or open it"
    )


def tell(result: BakeResult, outcomes: list[BlockOutcome]) -> None:
    """Iterations, curves and notes of all blocks together: light has settled where it has in every block."""
    result.iterations = max((outcome.iterations for outcome in outcomes), default=0)
    result.converged = all(outcome.converged for outcome in outcomes)
    result.missing = max((outcome.missing for outcome in outcomes), default=0.0)
    result.energy = _curve([outcome.energy for outcome in outcomes], np.mean)
    result.change = _curve([outcome.change for outcome in outcomes], np.max)
    moved = sum(outcome.moved for outcome in outcomes)
    if moved:
        result.notes.append(f"{moved} probes in or behind walls were moved out, at most half a cell")
    patches = sum(outcome.patches for outcome in outcomes)
    result.notes.append(f"light bounces between {patches} patches of surface")
    if len(outcomes) > 1:
        result.notes[-1] += f" in {len(outcomes)} blocks"
        settled = sum(outcome.converged for outcome in outcomes)
        result.notes.append(f"the light of {settled} of {len(outcomes)} blocks settled; the slowest:")
    if outcomes:
        slowest = max(outcomes, key=lambda outcome: (not outcome.converged, outcome.iterations))
        result.notes.append(slowest.reason)


def _curve(curves: list[tuple[float, ...]], together) -> list[float]:
    """One value per iteration of the longest of ``curves``; those that ended stay where they were."""
    longest = max((len(curve) for curve in curves), default=0)
    curves = [curve for curve in curves if curve]
    if len(curves) == 1:
        return list(curves[0])
    return [float(together([curve[min(at, len(curve) - 1)] for curve in curves])) for at in range(longest)]
