# SPDX-License-Identifier: GPL-3.0-or-later
"""Live light: probes relit a few at a time end where a fresh bake would, and what is shown goes there without jumps."""

import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.result import Silent
from gridlight.bake.session import BakeSession
from gridlight.core.conventions import ACTIVE
from gridlight.core.gradients import per_cell
from gridlight.core.probe_edits import ProbeEdits
from gridlight.core.settings import BakeSettings
from gridlight.core.steps import Pace, run
from gridlight.gpu_shaders.live_field import LiveField
from gridlight.gpu_shaders.textures import read, wait_for_gpu
from gridlight.gpu_shaders.viewport_field import FieldTextures
from gridlight.tests.changed_snapshots import with_light, with_material, with_moved
from gridlight.viewport.live_bake import LiveBake, Target
from small_scenes import frame
from test_relight import SETTINGS, assert_same_bake, grid, rooms, session_of

WHERE = grid((5, 3, 4))
DARK = np.isin(np.arange(WHERE.count), [7, 8, 22, 37])  # switched off: nodes without light of their own
EDITS = ProbeEdits(DARK, np.zeros((WHERE.count, 3)))
ROOMS = rooms()
ONE_STEP = 0.0  # a budget that is spent by then
MOVED = with_light(ROOMS, 0, matrix=frame((-0.85, 0.25, 0.2)))


def shown_values(shown):
    """Coefficients (P, K, 3) and gradients over a cell (P, 3, K, 3) as pictures read them."""
    count, bands2, _ = shown.field.coefficients.shape
    transfer = shown.field.gradient.shape[2]
    field, gradient = shown.light_textures
    return (
        read(field, count * bands2)[:, :3].reshape(count, bands2, 3),
        read(gradient, count * 3 * transfer)[:, :3].reshape(count, 3, transfer, 3),
    )


@pytest.fixture(scope="module")
def relit(gpu_context):
    """A bake, what was shown of it, and its light after a lamp has moved, which no field knows yet."""
    session = BakeSession(BakeJob(ROOMS, WHERE, BakeSettings(**SETTINGS), EDITS), Silent())
    run(session.bake())
    before = session.result.field
    run(session.relight(MOVED, live=True))
    assert session.result.relit.kept_places
    assert session.unshown.all() and session.result.field is None
    run(session.show())
    assert not session.unshown.any()
    run(session.finish())
    return session, before, session.result.field


def test_what_is_shown_goes_to_the_field_of_the_bake(relit):
    session, before, after = relit
    shown = FieldTextures(before, WHERE.center)
    lead = LiveField(session.backend, shown)
    start, _ = shown_values(shown)
    active = after.state == ACTIVE
    assert not active[DARK].any()
    scale = np.abs(after.coefficients).max()
    assert np.abs(after.coefficients - before.coefficients).max() > 0.1 * scale
    lead.follow(0.25)
    quarter, _ = shown_values(shown)
    np.testing.assert_allclose(quarter[active], (0.75 * start + 0.25 * after.coefficients)[active], atol=1e-5 * scale)
    lead.follow(1.0)
    coefficients, gradient = shown_values(shown)
    np.testing.assert_allclose(coefficients[active], after.coefficients[active], atol=1e-5 * scale)
    expected = per_cell(WHERE, after.gradient)
    np.testing.assert_allclose(gradient[active], expected[active], atol=1e-5 * np.abs(expected).max())
    for _ in range(16):
        lead.follow(1.0)
    coefficients, _ = shown_values(shown)
    np.testing.assert_allclose(coefficients[~active], after.coefficients[~active], atol=1e-3 * scale)


def shown_in_parts(session):
    """The field of ``session`` from nothing, its probes in any order and a few at a time."""
    order = np.random.default_rng(5).permutation(len(session.unshown))
    session.unshown[:] = True
    session.backend.light_textures[0].clear(format="FLOAT", value=(0.0,) * 4)
    for part in np.array_split(order, 7):
        assert session.unshown[part].all()
        run(session.show(part))
        assert not session.unshown[part].any()
    run(session.finish())
    return session.result.field


def test_probes_in_any_order_and_in_parts_are_the_whole(relit):
    session, _, whole = relit
    parts = shown_in_parts(session)
    assert np.array_equal(parts.coefficients, whole.coefficients)
    assert np.array_equal(parts.gradient, whole.gradient)


@pytest.mark.nightly
def test_so_are_gathered_probes(gpu_context):
    session = session_of(ROOMS, grid(), gather=1)
    whole = session.result.field
    assert np.array_equal(shown_in_parts(session).coefficients, whole.coefficients)


def test_only_probes_that_were_relit_are_shown_anew(relit):
    session, _, after = relit
    shown = FieldTextures(after, WHERE.center)
    lead = LiveField(session.backend, shown)
    before, _ = shown_values(shown)
    run(session.relight(ROOMS, live=True))
    assert session.result.relit.kept_places
    some = np.arange(0, len(session.unshown), 3)
    run(session.show(some))
    lead.follow(1.0)
    after, _ = shown_values(shown)
    nodes = read(session.backend.probe_slots, session.backend.slot_count)[:, 3].astype(int)
    changed = np.abs(after - before).max(axis=(1, 2))[nodes] > 1e-6
    assert not np.delete(changed, some).any() and changed[some].mean() > 0.9
    run(session.relight(MOVED))


class SixteenAtATime(Pace):
    """That of a device for which sixteen probes are a step's work, however fast this one is."""

    def _learn(self, kind, number, growth):
        """Keeps to the first portion."""


def live_bake():
    return LiveBake(SixteenAtATime(0.004, wait_for_gpu))


class Views:
    """What a preview does with live light, without a window."""

    def __init__(self, field):
        self.shown = FieldTextures(field, WHERE.center)
        self.lead = None
        self.slices = []

    def frame(self, live, budget, share=0.3):
        progress = live.step(budget)
        if progress.fields:
            field = next(iter(progress.fields.values()))
            fresh = FieldTextures(field, WHERE.center)
            if not progress.is_settled:
                fresh.take_light_of(self.shown)
            self.shown = fresh
            self.lead = LiveField(live.backend_of(WHERE.name), fresh)
        elif progress.probes:
            self.slices.append(progress.probes)
        if self.lead:
            self.lead.follow(share)
        return progress


def test_live_light_comes_in_slices_without_jumps_and_ends_where_a_bake_does(relit):
    settings = BakeSettings(**SETTINGS)
    live, views = live_bake(), Views(relit[1])
    target = [Target(WHERE, EDITS)]
    live.follow(ROOMS, target, settings, 0.0)
    while live.is_working:
        views.frame(live, 1.0, share=1.0)
    assert live.shown_moment == 0.0
    before, _ = shown_values(views.shown)
    live.follow(MOVED, target, settings, 1.0)
    frames = [before]
    while live.is_working:
        views.frame(live, ONE_STEP)
        frames.append(shown_values(views.shown)[0])
    assert live.shown_moment == 1.0 and len(views.slices) > 2, views.slices
    for _ in range(25):
        views.frame(live, ONE_STEP)
        frames.append(shown_values(views.shown)[0])
    expected = relit[2]  # a relight is a fresh bake: test_relight.py
    active = expected.state == ACTIVE
    scale = np.abs(expected.coefficients).max()
    np.testing.assert_allclose(frames[-1][active], expected.coefficients[active], atol=3e-4 * scale)
    way = (expected.coefficients - before)[active]
    for last, now in zip(frames, frames[1:]):
        step = (now - last)[active]
        assert (np.abs(step) <= 0.3 * np.abs(way) + 1e-4 * scale).all(), "no probe jumps"
        assert (step * way >= -1e-6 * scale**2).all(), "no probe turns back"
    live.settle()
    settled = [views.frame(live, 1.0, share=1.0) for _ in range(100) if live.is_working]
    found = next(progress.fields[WHERE.name] for progress in settled if progress.is_settled)
    np.testing.assert_allclose(found.coefficients, expected.coefficients, atol=1e-5 * scale)


def test_lamps_that_never_rest_leave_no_probe_behind(relit):
    settings = BakeSettings(**SETTINGS)
    live, views = live_bake(), Views(relit[1])
    target = [Target(WHERE, EDITS)]
    live.follow(ROOMS, target, settings, 0.0)
    while live.is_working:
        views.frame(live, 1.0)
    seen = [0.0]
    for moment in range(1, 400):
        place = (-1.1 + 0.1 * np.sin(0.1 * moment), 0.4, 0.2)
        live.follow(with_light(ROOMS, 0, matrix=frame(place)), target, settings, float(moment))
        views.frame(live, ONE_STEP)
        if live.shown_moment != seen[-1]:
            seen.append(live.shown_moment)
        if len(seen) > 3:
            break
    assert len(seen) > 3 and seen == sorted(seen), "the oldest probe gets younger again and again"
    assert live.is_working


@pytest.mark.nightly
@pytest.mark.parametrize(
    "change",
    [lambda s: with_moved(s, 2, (0.05, 0.1, 0.0)), lambda s: with_material(s, 3, emission=(3.0, 9.0, 30.0))],
    ids=["a shape", "emission"],
)
def test_other_changes_end_where_a_bake_does_too(relit, change):
    settings = BakeSettings(**SETTINGS)
    live, views = LiveBake(), Views(relit[1])
    for moment, snapshot in enumerate((ROOMS, change(ROOMS))):
        live.follow(snapshot, [Target(WHERE, EDITS)], settings, float(moment))
        while live.is_working or live.is_rough:
            live.settle()
            views.frame(live, 1.0)
    expected = BakeSession(BakeJob(change(ROOMS), WHERE, settings, EDITS), Silent())
    run(expected.bake())
    assert_same_bake(
        type("Result", (), {"field": views.shown.field, "counts": expected.result.counts}), expected.result
    )
