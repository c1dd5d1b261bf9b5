# SPDX-License-Identifier: GPL-3.0-or-later
"""The child's side of ``bench``: what runs in a process of its own per measurement, and how it reports.

Every report is one JSON object on standard output, written as soon as it is known: ``{"run": …}`` is a row of a
table, ``{"problem": …}`` why there is no more; other keys are facts about the whole measurement.
"""

from __future__ import annotations

import json

from ..core.errors import Cancelled, GridlightError
from . import worker


def measure(request: dict, reporter, should_stop) -> tuple[dict, int]:
    """Measures ``request["peer"]``, reports rows as they are known, and returns (last report, exit status)."""
    # Here and not above: only the one that is asked for loads, and all of them report through this module.
    from . import (
        bench_measure_eevee,
        bench_measure_frame,
        bench_measure_pareto,
        bench_measure_peers,
        bench_measure_scaling,
        bench_measure_three,
    )

    measurements = {
        "gridlight": bench_measure_peers.gridlight,
        "cycles": bench_measure_peers.cycles,
        "eevee": bench_measure_eevee.eevee,
        "reference": bench_measure_peers.reference,
        "scaling": bench_measure_scaling.scaling,
        "three": bench_measure_three.three,
        "settings": bench_measure_pareto.settings_in_turn,
        "frame": bench_measure_frame.frame,
    }
    status = 0
    try:
        status = measurements[request["peer"]](request, reporter, should_stop) or 0
    except Cancelled:
        raise
    except (GridlightError, RuntimeError) as error:  # RuntimeError: how Blender's operators refuse
        report({"problem": " ".join(str(error).split())})
        status = getattr(error, "exit_status", 1)
    return {"status": status, "warnings": reporter.warnings}, status


def report(value: dict) -> None:
    worker.write_result(json.dumps(value, allow_nan=False) + "\n")
