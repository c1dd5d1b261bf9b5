# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress: sparse lines in a log, one line in place on a terminal, rate and time left that are right."""

import io

from gridlight.cli.progress import LINE_INTERVAL, Reporter


class Clock:
    seconds = 0.0

    def __call__(self):
        return self.seconds


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_log_gets_few_lines_with_rate_and_time_left():
    clock, stream = Clock(), io.StringIO()
    reporter = Reporter(stream, clock=clock)
    reporter.phase("capture", 1000)
    for _ in range(80):
        clock.seconds += 0.25
        reporter.advance(5)
    lines = stream.getvalue().splitlines()
    assert len(lines) == int(20 / LINE_INTERVAL)
    assert lines[-1] == "capture 400/1000 (40 %), 20/s, 30.0 s left"
    reporter.finish()
    assert stream.getvalue().splitlines()[-1] == "capture: 20.0 s, 400 at 20/s"


def test_a_terminal_gets_one_line_in_place():
    clock, stream = Clock(), Terminal()
    reporter = Reporter(stream, clock=clock)
    reporter.phase("light")
    for _ in range(10):
        clock.seconds += 0.5
        reporter.advance()
    assert "\n" not in stream.getvalue() and stream.getvalue().count("\r") == 11
    reporter.warn("look")
    assert stream.getvalue().endswith("\rwarning: look\n")


def test_quiet_silences_all_but_warnings():
    stream = io.StringIO()
    reporter = Reporter(stream, quiet=True)
    reporter.phase("read", 3)
    reporter.advance(3)
    reporter.note("auto chose trace")
    reporter.warn("no light")
    reporter.warn("no light")
    reporter.finish()
    assert stream.getvalue() == "warning: no light\n" and reporter.warnings == ["no light"]


def test_an_abandoned_phase_says_nothing():
    stream = io.StringIO()
    reporter = Reporter(stream)
    reporter.phase("read")
    reporter.abandon()
    reporter.finish()
    assert stream.getvalue() == ""
