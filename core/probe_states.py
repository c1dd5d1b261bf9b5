# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a probe has the state it has, in the words that panels, the view, reports and summaries share."""

from __future__ import annotations

import numpy as np

from .conventions import CULLED, INVALID
from .field import Field
from .orientation import MOST_BEHIND

CULLED_MEANS = "culled: lights nothing, or switched off"
# Why probes are invalid (see orientation.inside_solid), by the name that it has in summaries.
IN_SOLID, BEHIND_WALLS, NOT_BAKED = "in_solid", "behind_walls", "not_baked"
WORDS = {
    IN_SOLID: "in a solid",
    BEHIND_WALLS: "in the dark behind walls",
    NOT_BAKED: "not baked (a shard is missing)",
}
_AT_HOME = 1e-5  # cells: steps are rounded


def invalid_because(field: Field) -> dict[str, np.ndarray]:
    """Ascending nodes by reason: each invalid probe of ``field`` once. Views ask for every frame."""
    nodes = np.flatnonzero(field.state == INVALID)
    captured = field.depth[nodes].any(axis=(1, 2))
    solid = field.validity[nodes] < 1.0 - MOST_BEHIND
    return {
        IN_SOLID: nodes[captured & solid],
        BEHIND_WALLS: nodes[captured & ~solid],
        NOT_BAKED: nodes[~captured],
    }


def invalid_counts(fields: list[Field]) -> dict[str, int]:
    """Invalid probes of ``fields`` by reason, of reasons that there are."""
    found = [invalid_because(field) for field in fields]
    counts = {reason: sum(len(nodes[reason]) for nodes in found) for reason in WORDS}
    return {reason: count for reason, count in counts.items() if count}


def invalid_in_words(counts: dict[str, int]) -> str:
    """``counts`` by reason as a sentence goes on after "invalid"; without any, what it means."""
    if not counts:
        return f"{WORDS[IN_SOLID]} or {WORDS[BEHIND_WALLS]}"
    if len(counts) == 1:
        return WORDS[next(iter(counts))]
    return ", ".join(f"{count} {WORDS[reason]}" for reason, count in counts.items())


def describe(field: Field, node: int) -> str:
    """What there is to know about the probe at ``node``: its state, why, and how far it stands from its node."""
    if field.state[node] == CULLED:
        return f"{CULLED_MEANS}; its light is its own" if field.holds_light[node] else CULLED_MEANS
    if field.state[node] == INVALID:
        return next(f"invalid: {WORDS[reason]}" for reason, nodes in invalid_because(field).items() if node in nodes)
    distance = float(np.linalg.norm(field.offset[node]))
    if distance <= _AT_HOME * field.grid.cell_size().min():
        return "active, at its node"
    return f"active, moved {distance:.2g} m from its node"
