# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench``: speed against error, ours and the peers' side by side, in one run on one machine.

Everything is measured in processes of their own, one after the other (``bench_measure``), so that one that fails ends
only itself. A benchmark is a module ``bench_NAME`` as ``bench_run`` describes it.
"""

from __future__ import annotations

import argparse
import importlib
import json
from pathlib import Path

from ..core.errors import InputError
from ..formats.staging import StagedFolder
from . import bake, bench_run

HELP = "measures speed against error, peers side by side"
NEEDS_BLENDER = NEEDS_GPU = False  # this process only starts others, which have both

DEFAULT = "peers"
# name -> (what it measures, seconds that it may take unless --limit says something else)
BENCHMARKS = {
    "peers": ("the gallery by our bake, Cycles panoramas and EEVEE", 1800.0),
    "scaling": ("cost of a bake over probes, triangles and texels, by phase", 600.0),
    "pareto": ("error over time of many settings, ours and the peers'", 1800.0),
    "frame": ("a time-sliced relight and a preview frame, by shader", 600.0),
}


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        choices=BENCHMARKS,
        help="; ".join(f"{name}: {what}" for name, (what, _) in BENCHMARKS.items()) + f" (default {DEFAULT})",
    )
    parser.add_argument("-o", "--output", metavar="DIR", help="folder for NAME.txt, NAME.json and NAME.svg")
    parser.add_argument(
        "--panoramas",
        metavar="N",
        type=int,
        help="measure Cycles at N of the grid's locations and scale (default: at all)",
    )
    parser.add_argument("--no-eevee", action="store_true", help="leave EEVEE out")
    parser.add_argument(
        "--no-three", action="store_true", help="for pareto: leave three.js out, which needs Chromium and npm"
    )
    parser.add_argument(
        "--eevee-samples",
        metavar="N",
        type=int,
        default=2048,
        help="samples of EEVEE's volume bake (default %(default)s, which is Blender's)",
    )
    parser.add_argument("--error", action="store_true", help="also measure irradiance errors at free nodes")
    parser.add_argument(
        "--error-nodes", metavar="N", type=int, default=24, help="nodes for --error (default %(default)s)"
    )
    parser.add_argument(
        "--error-spp",
        metavar="S",
        type=int,
        default=128,
        help="samples of the 128×64 reference for --error, in each of two seeds (default %(default)s)",
    )
    parser.add_argument(
        "--limit",
        metavar="SECONDS",
        type=float,
        help="time that each peer may take, or all of scaling and frame (default: 1800 or 600)",
    )
    parser.add_argument(
        "--budget", metavar="SECONDS", type=float, help="time for everything: what does not fit is left out and named"
    )
    parser.add_argument(
        "--scene",
        metavar="NAME",
        action="append",
        help="for pareto: gallery, cornell or a .blend; repeatable (default: gallery and cornell)",
    )
    bake.add_settings(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")
    parser.add_argument("--verbose", action="store_true", help="show what Blender itself prints")
    parser.add_argument("--measure", help=argparse.SUPPRESS)  # for the processes that this starts: a request as JSON
    parser.set_defaults(in_blender=in_blender)


def check(args) -> None:
    """What can be refused before anything is measured."""
    bake.settings_from(args)
    for name, value, low, high in (
        ("--panoramas", args.panoramas, 1, 1 << 24),
        ("--error-nodes", args.error_nodes, 1, 1000),
        ("--eevee-samples", args.eevee_samples, 1, 1 << 20),
        ("--error-spp", args.error_spp, 1, 1 << 20),
        ("--limit", args.limit, 1, 1_000_000),
        ("--budget", args.budget, 1, 1_000_000),
    ):
        if value is not None and not low <= value <= high:
            raise InputError(f"{name} is {value}; it must lie between {low} and {high}")
    for name in args.scene or []:
        if name not in bench_run.SCENES and not Path(name).is_file():
            raise InputError(f"{name}: no such file; name one, or {' or '.join(bench_run.SCENES)}")


def run(args, reporter, should_stop):
    if args.measure:
        from . import bench_measure

        return bench_measure.measure(json.loads(args.measure), reporter, should_stop)
    check(args)
    if args.name is None:
        others = "; ".join(f"{name}, {what}" for name, (what, _) in BENCHMARKS.items() if name != DEFAULT)
        reporter.note(f"no name was given, so this is {DEFAULT}: {BENCHMARKS[DEFAULT][0]}. There are also {others}")
        args.name = DEFAULT
    benchmark = importlib.import_module(f".bench_{args.name}", __package__)
    if args.limit is None:
        args.limit = BENCHMARKS[args.name][1]
    if args.output is None:
        return bench_run.run(benchmark, args, reporter, None)
    with StagedFolder(args.output) as folder:  # refuses a folder that cannot be written before the long work
        return bench_run.run(benchmark, args, reporter, folder)
