# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight eval``: irradiance at points, from a probe file, exactly as the preview would show it."""

from __future__ import annotations

import time
from pathlib import Path

from ..core import lookup
from ..core.errors import Cancelled, InputError
from ..formats import points_csv, probe_file
from ..formats.staging import StagedFolder

HELP = "irradiance at points, from a probe file"
NEEDS_BLENDER = NEEDS_GPU = False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("probes", metavar="PROBES.exr")
    parser.add_argument("--points", metavar="P.csv", required=True, help="rows x,y,z,nx,ny,nz under a header row")
    parser.add_argument("-o", "--output", metavar="E.csv", required=True, help="gets the rows with Er,Eg,Eb added")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def run(args, reporter, should_stop):
    started = time.perf_counter()
    field = probe_file.read(args.probes)
    output = Path(args.output)
    if output.is_dir():
        raise InputError(f"{output} is a folder; name the file to write")
    count = 0
    try:
        points = open(args.points, encoding="utf-8", newline=None)
    except OSError as error:
        raise InputError(f"cannot read {args.points}: {error.strerror}; name a CSV file of points") from None
    reporter.phase("eval")
    with points, StagedFolder(output.parent) as folder:
        with open(folder.path(output.name), "w", encoding="utf-8", newline="\n") as table:
            table.write(points_csv.HEADER_OUT + "\n")
            for rows, values in points_csv.read_blocks(points, args.points):
                if should_stop():
                    raise Cancelled()
                table.write(points_csv.format_rows(rows, lookup.irradiance(field, values[:, :3], values[:, 3:])))
                count += len(rows)
                reporter.advance(len(rows))
        if not count:
            reporter.warn(f"{args.points} holds no points")
    return {
        "points": count,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "files": [args.output],
        "warnings": reporter.warnings,
    }, 0
