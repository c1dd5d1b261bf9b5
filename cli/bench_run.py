# SPDX-License-Identifier: GPL-3.0-or-later
"""One run of a benchmark: starts its measurements, makes table, JSON and picture of what they report.

A benchmark is a module with ``measure(run) -> facts`` (which become part of the summary), ``table(summary) -> lines``
and ``plot(summary) -> SVG``. ``facts`` hold at least "device" and "blender".
"""

from __future__ import annotations

import json
import time
from contextlib import contextmanager

from ..core.errors import InputError, NoGpuError
from ..formats.probe_metadata import program_version
from . import bake, bench_machine, bench_process, system_libraries

SCENES = ("gallery", "cornell")  # that bench_scenes builds; other names are those of files
_LEAST_SECONDS = 3.0  # below which starting a process is not worth it


class Run:
    """What benchmarks need of this run: ``args``, ``settings``, ``limit_s``, and ``child`` for measurements."""

    def __init__(self, args, reporter):
        """Raises NoGpuError where there is no driver that could make a GPU context."""
        problem = None if args.in_blender else system_libraries.ensure(reporter.note)
        if problem:
            raise NoGpuError(problem)
        self.args = args
        self.settings = bake.settings_from(args)
        self.settings_dict = vars(self.settings)
        self.reporter = reporter
        self._ends = time.perf_counter() + args.budget if args.budget else float("inf")

    @property
    def limit_s(self) -> float:
        """Seconds that the next measurement may take: --limit, or what is left of --budget."""
        return min(self.args.limit, self.left_s)

    @property
    def left_s(self) -> float:
        """Seconds until the time is up; infinite without --budget."""
        return self._ends - time.perf_counter()

    @contextmanager
    def within(self, seconds: float):
        """Inside, what is measured must be done in ``seconds``."""
        ends = self._ends
        self._ends = min(ends, time.perf_counter() + seconds)
        try:
            yield
        finally:
            self._ends = ends

    def child(self, request: dict, what: str, optional: bool = False) -> tuple[dict, list[dict], list[dict]]:
        """Runs one measurement in a process of its own.

        Returns (its reports merged, "problem" where it ended early; those that are rows; all of them).

        Raises:
            InputError: it ended before it told the device, and is not ``optional``: there is nothing to report.
        """
        args = self.args
        options = ["--quiet"] if args.quiet else []
        self.reporter.note(what)
        limit_s = self.limit_s
        reports: list[dict]
        spent = self.left_s < _LEAST_SECONDS
        if spent:
            reports, problem = [], "left out: the time of --budget is spent"
        else:
            reports, problem = bench_process.measure_in_child(request, limit_s, options, args.in_blender, args.verbose)
        merged = {}
        for report in reports:
            if "run" not in report:
                merged.update(report)
        for warning in merged.get("warnings", []):  # the child has shown them already
            if warning not in self.reporter.warnings:
                self.reporter.warnings.append(warning)
        if problem:
            merged["problem"] = problem
            if optional and not spent:
                self.reporter.warn(f"{what}: {problem}")
        if not optional and "device" not in merged:
            raise InputError(f"{what} could not be measured: {problem or 'its process said nothing'}")
        return merged, [report for report in reports if "run" in report], reports


def run(benchmark, args, reporter, folder) -> tuple[dict, int]:
    """Measures ``benchmark``, a module as above. Returns (summary, exit status); stages files in ``folder`` unless it
    is None."""
    started = time.perf_counter()
    machine = bench_machine.describe()
    facts = benchmark.measure(Run(args, reporter))
    status = facts.pop("status", 0)
    summary = {
        "bench": args.name,
        "command": bench_machine.command(),
        "version": program_version(),
        "blender": facts.pop("blender"),
        "device": facts.pop("device"),
        "machine": machine,
        **facts,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "files": [],
        "warnings": reporter.warnings,
    }
    text = "\n".join([*bench_machine.head(summary), "", *benchmark.table(summary)])
    reporter.result(text)
    if folder is not None:
        names = {kind: f"{args.name}.{kind}" for kind in ("txt", "json", "svg")}
        summary["files"] = [str(folder.folder / name) for name in names.values()]
        content = {
            "txt": text + "\n",
            "json": json.dumps(summary, indent=1, allow_nan=False) + "\n",
            "svg": benchmark.plot(summary),
        }
        for kind, name in names.items():
            folder.path(name).write_text(content[kind], encoding="utf-8")
    return summary, status
