# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes in blocks: closed forms hold across seams, memory changes no byte, and what only all probes together can tell
is told by all."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.block_session import open_session
from gridlight.bake.result import Silent
from gridlight.core.blocks import cut
from gridlight.core.conventions import ACTIVE, INVALID
from gridlight.core.grid import Grid
from gridlight.core.probe_states import invalid_counts
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from small_scenes import all_lights, bake, box, cluttered_room, frame, furnace, irradiance_at_nodes, snapshot_of


def field_bytes(result):
    field = result.field
    return b"".join(
        np.ascontiguousarray(getattr(field, name)).tobytes()
        for name in ("coefficients", "state", "validity", "offset", "depth", "gradient")
    )


@pytest.mark.parametrize("block", [1, pytest.param(9, marks=pytest.mark.any_version)])
def test_a_furnace_has_no_seams(block):
    grid = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (4, 3, 3) if block > 1 else (2, 2, 1))
    result = bake(furnace(0.9), grid, BakeSettings(face=8, block=block))
    assert result.converged and result.counts["active"] == grid.count
    np.testing.assert_allclose(irradiance_at_nodes(result.field) * 0.1, 1, atol=5e-3)


@pytest.mark.nightly
def test_the_memory_budget_changes_no_byte():
    """Blocks that take turns end where blocks that stay do."""
    snapshot = cluttered_room({"point soft": all_lights()["point soft"], "sun": all_lights()["sun"]})
    grid = Grid.from_bounds((-1.4, -1.1, -0.9), (1.3, 1.2, 1.0), (5, 4, 4))
    settings = BakeSettings(face=32, block=20, keep_all=True, capture="trace")
    results = []
    for memory_mib in (512, 16):
        session = open_session(BakeJob(snapshot, grid, replace(settings, memory_mib=memory_mib)), Silent())
        for _ in session.bake():
            assert len(session.open_blocks) <= (1 if memory_mib == 16 else len(cut(grid, 20)))
        results.append(session.result)
    assert any("take turns" in note for note in results[1].notes)
    assert field_bytes(results[0]) == field_bytes(results[1])


@pytest.mark.any_version
def test_blocks_see_the_light_that_one_grid_sees():
    """Each block has patches and random numbers of its own: what differs is noise, no step at seams."""
    snapshot = cluttered_room({"rectangle": all_lights()["rectangle"]}, clutter=8)
    grid = Grid.from_bounds((-1.4, -1.1, -0.9), (1.3, 1.2, 1.0), (4, 4, 2))
    settings = BakeSettings(face=8, keep_all=True, capture="trace")
    whole, parts = (bake(snapshot, grid, replace(settings, block=block)) for block in (4096, 16))
    np.testing.assert_array_equal(whole.field.state, parts.field.state)
    active = whole.field.state == ACTIVE
    found, expected = irradiance_at_nodes(parts.field)[active], irradiance_at_nodes(whole.field)[active]
    relative = (found - expected) / expected.mean()
    assert np.sqrt((relative**2).mean()) < 0.03
    assert abs(relative.mean()) < 0.005


@pytest.mark.any_version
def test_light_in_another_block_tells_a_solid():
    """Probes that see nothing but dark back faces are inside a solid if any probe sees light, in whichever block."""
    room, solid = box((-3, -1, -1), (0, 1, 1)), box((0.5, -1, -1), (3.5, 1, 1))
    snapshot = snapshot_of(
        np.concatenate([room[:, ::-1], solid]),
        objects=[0] * 12 + [1] * 12,
        materials=[Material("grey", (0.6, 0.6, 0.6))],
        lights=[Light("lamp", "POINT", (3.0, 3.0, 3.0), frame((-1.5, 0.2, 0.3)))],
    )
    grid = Grid.from_bounds((-2.6, -0.4, -0.4), (3.1, 0.4, 0.4), (8, 2, 2))
    whole, parts = (bake(snapshot, grid, BakeSettings(face=8, keep_all=True, block=block)) for block in (4096, 16))
    inside = grid.positions()[:, 0] > 0.5
    np.testing.assert_array_equal(whole.field.state == INVALID, inside)
    np.testing.assert_array_equal(parts.field.state, whole.field.state)
    assert invalid_counts([whole.field]) == invalid_counts([parts.field]) == {"in_solid": inside.sum()}


@pytest.mark.any_version
def test_a_dark_scene_is_dark_in_all_blocks():
    """Where no probe sees light nothing is invalid, in one block or in many."""
    snapshot = snapshot_of(box(), materials=[Material("grey")])
    grid = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (3, 2, 2))
    for block in (4096, 4):
        result = bake(snapshot, grid, BakeSettings(face=8, block=block))
        assert result.counts["invalid"] == 0 and not result.field.coefficients.any()
