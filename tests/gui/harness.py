# SPDX-License-Identifier: GPL-3.0-or-later
"""Marks tests that run inside the real Blender with a window.

A test is a generator that plays a person in front of Blender: it acts, yields the seconds that it waits (Blender
goes on in that time), looks, and asserts. The file is imported twice: by pytest, where the mark turns it into a test
that sends its name to a running Blender, and by that Blender, which runs it. So modules here import nothing but the
standard library, numpy, bpy and this one at their top; what belongs to the extension is imported inside the tests.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable

BACKENDS = ("opengl", "vulkan")
INSIDE_BLENDER = "--gridlight-test-server" in sys.argv  # an argument behind Blender's "--"


def in_blender(
    backends: tuple[str, ...] = BACKENDS, timeout: float = 120.0, cases: Iterable = (), nightly_cases: Iterable = ()
) -> Callable:
    """Makes a test of a generator function that takes a ``person.Person``.

    Args:
        backends: GPU backends to run on; one is enough for what does not draw.
        timeout: seconds until Blender counts as hanging.
        cases: run the scenario once for each, with the case as a second argument; numbers or texts.
        nightly_cases: more of them, for nightly runs.
    """

    def mark(scenario: Callable) -> Callable:
        if INSIDE_BLENDER:
            return scenario
        import pytest

        chosen = [pytest.param([case], id=str(case)) for case in cases]
        chosen += [pytest.param([case], id=str(case), marks=pytest.mark.nightly) for case in nightly_cases]

        @pytest.mark.parametrize("blender", backends, indirect=True, scope="session")
        @pytest.mark.parametrize("arguments", chosen or [pytest.param([], id="")])
        def test(blender, arguments):
            blender.run(scenario.__code__.co_filename, scenario.__name__, arguments, timeout)

        test.__name__, test.__doc__, test.__module__ = scenario.__name__, scenario.__doc__, scenario.__module__
        return test

    return mark
