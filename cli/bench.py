# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench``: speed against error, ours and the peers' side by side, in one run on one machine.

``bench peers`` gives every peer a process of its own, one after the other. What each measures is in ``bench_measure``.
"""

from __future__ import annotations

import json

from ..core.errors import InputError
from ..formats.staging import StagedFolder
from . import bake, bench_peers

HELP = "measures speed against error, peers side by side"
NEEDS_BLENDER = NEEDS_GPU = False  # this process only starts others, which have both


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument(
        "name",
        metavar="NAME",
        nargs="?",
        choices=("peers",),
        default="peers",
        help="peers: the gallery by our bake, Cycles panoramas and EEVEE (default; the only one)",
    )
    parser.add_argument("-o", "--output", metavar="DIR", help="folder for peers.txt, peers.json and peers.svg")
    parser.add_argument(
        "--panoramas",
        metavar="N",
        type=int,
        help="measure Cycles at N of the grid's locations and scale (default: at all)",
    )
    parser.add_argument("--no-eevee", action="store_true", help="leave EEVEE out")
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
        default=1800.0,
        help="time that each peer may take (default %(default)s)",
    )
    bake.add_settings(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")
    parser.add_argument("--verbose", action="store_true", help="show what Blender itself prints")
    parser.add_argument("--measure", help="for the processes that this command starts: what to measure, as JSON")
    parser.set_defaults(in_blender=in_blender)


def check(args) -> None:
    """What can be refused before anything is measured."""
    bake.settings_from(args)
    for name, value, low, high in (
        ("--panoramas", args.panoramas, 1, 1 << 24),
        ("--error-nodes", args.error_nodes, 1, 1000),
        ("--eevee-samples", args.eevee_samples, 1, 1 << 20),
        ("--error-spp", args.error_spp, 1, 1 << 20),
        ("--limit", args.limit, 1, 1e6),
    ):
        if value is not None and not low <= value <= high:
            raise InputError(f"{name} is {value}; it must lie between {low} and {high:g}")


def run(args, reporter, should_stop):
    if args.measure:
        from . import bench_measure

        return bench_measure.measure(json.loads(args.measure), reporter, should_stop)
    check(args)
    if args.output is None:
        return bench_peers.run(args, reporter, None)
    with StagedFolder(args.output) as folder:  # refuses a folder that cannot be written before the long work
        return bench_peers.run(args, reporter, folder)
