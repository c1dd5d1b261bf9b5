# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probe an export of a single one takes: cubemaps, three.js's LightProbe, Filament's environment light."""

from __future__ import annotations

import numpy as np

from ..core.conventions import ACTIVE
from ..core.errors import InputError

LOSSES = ["all probes but one: the light is the same everywhere", "visibility weights and gradients of probes"]


def choose_probe(job) -> int:
    """Flat index of the probe asked for; without one, of the active probe nearest to the middle of the box.

    Raises:
        InputError: there is no such probe.
    """
    grid = job.source.grid
    if job.options.probe is not None:
        place, counts = np.array(job.options.probe), np.array(grid.resolution)
        if (place < 0).any() or (place >= counts).any():
            shown = ",".join(map(str, job.options.probe))
            raise InputError(f"--probe {shown}: the grid has {' × '.join(map(str, counts))} probes, counted from 0")
        return int(place @ [1, counts[0], counts[0] * counts[1]])
    active = np.flatnonzero(job.source.state == ACTIVE)
    if not len(active):
        raise InputError("no probe is active; name one with --probe I,J,K")
    distance = np.linalg.norm(grid.positions()[active] - grid.center, axis=1)
    return int(active[distance.argmin()])


def place_of(job, node: int) -> dict:
    """What the conventions say about the probe ``node``: its lattice place and its position in the target's space."""
    return {
        "probe": job.source.grid.lattice()[node].tolist(),
        "position": job.lattice.grid.positions()[node].tolist(),
    }


def nine_coefficients(job, node: int) -> np.ndarray:
    """(9, 3) radiance coefficients of the probe ``node`` in the target's axes; zeros for bands that it lacks."""
    found = job.lattice.coefficients[node][:9]
    return np.concatenate([found, np.zeros((9 - len(found), 3), found.dtype)])
