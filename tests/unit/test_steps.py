# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps: everything is done once and in order, portions grow and shrink with the time they take."""

import threading
import time

import pytest
from gridlight.core import steps
from gridlight.core.steps import Pace, run, together


class Clock:
    """Stands in for ``time`` where portions are timed: a busy machine must not decide how they grow."""

    def __init__(self):
        self.now = 0.0

    def perf_counter(self):
        return self.now


def counted(pace, count, seconds_each=0.0, **options):
    """The portions (start, number) in which ``count`` items are done, each in exactly so many seconds."""
    done, clock = [], Clock()

    def work(start, number):
        done.append((start, number))
        clock.now += seconds_each * number

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(steps, "time", clock)
        run(pace.portions("item", count, work, **options))
    return done


def test_without_steps_everything_is_one_portion():
    assert counted(Pace(None), 1000) == [(0, 1000)]
    assert counted(Pace(None), 1000, at_once=400) == [(0, 400), (400, 400), (800, 200)]
    assert counted(Pace(None), 0) == []


def test_portions_cover_all_items_in_order():
    done = counted(Pace(0.002), 500, 1e-5, first=3)
    assert [start for start, _ in done] == [sum(number for _, number in done[:i]) for i in range(len(done))]
    assert sum(number for _, number in done) == 500 and done[0] == (0, 3)


def test_portions_grow_to_what_fits_and_are_remembered():
    pace = Pace(0.02)
    done = counted(pace, 200, 0.001)
    assert len(done) > 5 and max(number for _, number in done) <= 64
    assert counted(pace, 200, 0.001)[0][1] > 4, "the next round begins with what was learned"


def test_portions_shrink_where_items_take_long():
    assert max(number for _, number in counted(Pace(0.004), 12, 0.01, first=4)[1:]) == 1


def test_background_work_returns_and_raises():
    pace = Pace(0.01)
    steps, seen = pace.in_background(lambda: (time.sleep(0.05), threading.current_thread())[1]), 0
    try:
        while True:
            next(steps)
            seen += 1
    except StopIteration as end:
        assert end.value is not threading.current_thread() and seen > 3
    with pytest.raises(ZeroDivisionError):
        run(pace.in_background(lambda: 1 / 0))
    assert run(Pace(None).in_background(threading.current_thread)) is threading.current_thread()


@pytest.mark.parametrize("seconds", [None, 0.01])
def test_work_begins_before_its_steps_are_followed(seconds):
    begun, pace = threading.Event(), Pace(seconds)
    steps = pace.meanwhile(lambda: begun.set() or 7)
    assert begun.wait(10) and run(steps) == 7
    with pytest.raises(ZeroDivisionError):
        run(pace.meanwhile(lambda: 1 / 0))


def test_together_goes_in_lockstep_and_gives_all_results():
    seen = []

    def steps(name, count):
        for index in range(count):
            seen.append(f"{name}{index}")
            yield
        return name

    ticks = 0
    both = together(steps("a", 1), steps("b", 3))
    while True:
        try:
            next(both)
        except StopIteration as end:
            assert end.value == ["a", "b"]
            break
        ticks += 1
    assert seen == ["a0", "b0", "b1", "b2"] and ticks == 3
    assert run(together()) == []
