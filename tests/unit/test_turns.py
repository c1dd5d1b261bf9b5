# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake and a window share the time: half of it is work however long drawing takes, and progress costs a fifth."""

import pytest
from gridlight.core.steps import STEP_SECONDS
from gridlight.operators import turns
from gridlight.operators.turns import MOST_SECONDS, Turns

pytestmark = pytest.mark.any_version


class Clock:
    """Stands in for ``time``."""

    def __init__(self):
        self.now = 0.0

    def perf_counter(self):
        return self.now


def follow(monkeypatch, seconds, step, event, picture):
    """Turns for about ``seconds`` with steps of ``step`` seconds; Blender takes ``event`` for itself after each, and
    ``picture`` more where the progress is shown. Returns (share of the time that is work, pictures a second, the
    longest that Blender had to wait)."""
    clock = Clock()
    monkeypatch.setattr(turns, "time", clock)
    shared = Turns()
    work, pictures, longest = 0.0, 0, 0.0
    while clock.now < seconds:
        clock.now += event
        began, deadline = clock.now, shared.begin()
        while clock.now < deadline:
            clock.now += step
        work += clock.now - began
        longest = max(longest, clock.now - began)
        if shared.end():
            pictures += 1
            clock.now += picture
    return work / clock.now, pictures / clock.now, longest


def test_a_quick_window_waits_a_step_and_shows_ten_pictures_a_second(monkeypatch):
    work, pictures, longest = follow(monkeypatch, 20.0, 0.001, 0.01, 0.002)
    assert work > 0.6 and 7 < pictures <= 10 and longest < 1.1 * STEP_SECONDS


@pytest.mark.parametrize("drawing", [0.05, 0.2])
def test_half_of_the_time_is_work_however_long_drawing_takes(monkeypatch, drawing):
    work, _, longest = follow(monkeypatch, 60.0, 0.001, drawing, 0.0)
    assert work >= 0.5 and longest < drawing + 0.002


def test_a_window_that_takes_seconds_is_answered_all_the_same(monkeypatch):
    assert follow(monkeypatch, 60.0, 0.001, 3.0, 0.0)[2] < MOST_SECONDS + 0.002


@pytest.mark.parametrize("picture", [0.05, 0.12, 0.19])
def test_pictures_of_the_progress_take_a_fifth_of_the_time_at_most(monkeypatch, picture):
    _, pictures, _ = follow(monkeypatch, 60.0, 0.001, 0.01, picture)
    assert 0.1 < pictures * picture < 0.25


def test_the_first_turn_shows_the_progress():
    shared = Turns()
    shared.begin()
    assert shared.end()
