# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight verify``: how far a probe file is from Cycles, which knows nothing of it."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from ..core import measures
from ..core.conventions import ACTIVE
from ..core.errors import InputError
from ..core.field import Field
from ..core.ringing import ringing
from ..core.world_suns import extract_suns
from ..formats import probe_file, report_errors
from ..formats.report import write_page
from ..formats.staging import StagedFolder
from . import arguments, verify_points
from .verify_measure import Points, Reference, Row, measure

HELP = "compares a probe file with Cycles panoramas of its scene"
NEEDS_BLENDER, NEEDS_GPU = True, False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("file", metavar="FILE.blend")
    parser.add_argument("probes", metavar="PROBES.exr")
    parser.add_argument(
        "--points",
        metavar="N",
        type=int,
        default=48,
        help="of each kind: probes, free points, surface points (default %(default)s)",
    )
    parser.add_argument(
        "--spp",
        metavar="S",
        type=int,
        default=16,
        help="Cycles samples per pixel and seed; two seeds are rendered (default %(default)s)",
    )
    parser.add_argument("--height", metavar="N", type=int, default=64, help="rows of a panorama (default %(default)s)")
    parser.add_argument(
        "--seed", metavar="N", type=int, default=0, help="of the choice of points (default %(default)s)"
    )
    parser.add_argument(
        "--trilinear",
        action="store_true",
        help="also the error of perfect probes at the nodes with plain trilinear lookup; renders those nodes too",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help="folder for the report with maps of the error (default: that of PROBES.exr)",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    """What can be refused before Blender starts."""
    for name, value, low, high in (
        ("--points", args.points, 1, 100_000),
        ("--spp", args.spp, 1, 1 << 20),
        ("--height", args.height, 8, 4096),
        ("--seed", args.seed, 0, 2**31 - 1),
    ):
        if not low <= value <= high:
            raise InputError(f"{name} is {value}; it must lie between {low} and {high}")
    arguments.check_exists(args.file, args.probes)


def run(args, reporter, should_stop):
    from ..formats.probe_metadata import scene_hash
    from ..scene.open_file import open_blend
    from ..scene.read import read_scene

    check(args)
    started = time.perf_counter()
    field = probe_file.read(args.probes)
    name = f"{Path(args.probes).stem}_verify.html"
    with StagedFolder(args.output or Path(args.probes).parent) as folder:
        reporter.phase("read")
        scene = open_blend(args.file)
        frame = field.metadata.get("scene", {}).get("frame")
        snapshot = read_scene(scene, frame=frame)
        for warning in snapshot.warnings:
            reporter.warn(warning)
        if not len(snapshot.triangles):
            raise InputError(
                f"{args.file}: scene '{snapshot.name}' has no surface that renders; name the file that was baked"
            )
        if field.metadata.get("scene_hash") not in (None, scene_hash(snapshot)):
            reporter.warn(
                f"the scene in {args.file} is not the one that was baked into {args.probes}: it has changed since, or "
                "another Blender reads it differently"
            )
        reporter.phase("points")
        space = verify_points.FreeSpace(snapshot, verify_points.cycles_light(scene, frame))
        kinds = choose_points(field, space, args.points, args.seed)
        _, suns = extract_suns(snapshot.world)
        reference = Reference(scene, args.spp, args.height, frame, reporter, should_stop, suns)
        rows = measure(field, kinds, reference, reporter, args.trilinear)
        engine = f"Cycles {2 * args.height}×{args.height}, 2 × {args.spp} samples"
        reporter.result(table(rows, field, engine))
        facts = [f"against {engine}", f"seed {args.seed}"]
        title = f"{Path(args.probes).name} against {Path(args.file).name}"
        outlines = report_errors.outlines(snapshot)
        found = [_for_report(row) for row in rows]
        text = report_errors.errors_html(title, facts, found, field.grid, outlines, field.bands, reporter.warnings)
        write_page(folder.path(name), text)
    summary = {
        "points": {row.points.name: row.as_dict() for row in rows},
        "bands": field.bands,
        "ringing": ringing(field.coefficients[field.state == ACTIVE]).as_dict(),
        "reference": {
            "engine": "Cycles",
            "width": 2 * args.height,
            "height": args.height,
            "samples": args.spp,
            "seeds": 2,
        },
        "prediction": against_prediction(rows, field),
        "seed": args.seed,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "files": [str(folder.folder / name)],
        "warnings": reporter.warnings,
    }
    return summary, 0


def choose_points(field: Field, space: verify_points.FreeSpace, count: int, seed: int) -> list[Points]:
    """Active probes, random free points and random surface points in the volume of ``field``, up to ``count`` of each.

    Raises:
        InputError: no active probe stands in free space.
    """
    random = np.random.default_rng(seed)
    nodes = np.flatnonzero(field.state == ACTIVE)
    nodes = nodes[random.permutation(len(nodes))[: max(4 * count, 64)]]
    positions = (field.grid.positions() + field.offset)[nodes]
    free = space.is_free(positions)
    nodes, positions = nodes[free][:count], positions[free][:count]
    if not len(nodes):
        raise InputError(
            f"{field.grid.name}: none of its active probes stands in free space of this scene; "
            "name the scene that was baked"
        )
    free = verify_points.free_points(space, field.grid, count, seed)
    surface, normals = verify_points.surface_points(space, field.grid, count, seed)
    six = verify_points.SIX_NORMALS
    kinds = [
        Points("probes", positions, np.broadcast_to(six, (len(nodes), *six.shape)), nodes),
        Points("free points", free, np.broadcast_to(six, (len(free), *six.shape))),
    ]
    if len(surface):
        kinds.append(Points("surface points", surface, normals[:, None]))
    return kinds


def _for_report(row: Row) -> report_errors.KindOfPoints:
    errors, biases = measures.point_errors(row.measured, row.reference, row.error.scale)
    return report_errors.KindOfPoints(
        row.points.name,
        row.points.positions,
        errors,
        biases,
        row.error,
        row.floor,
        row.trilinear,
        row.noise,
        row.negative,
        row.negative_floor,
    )


def table(rows: list[Row], field: Field, engine: str) -> str:
    """The rows as text, errors in percent of the reference's RMS."""
    heads = f"{'':16}{'points':>7}{'rel. RMS':>10}{'bias':>8}{'95th':>8}{'worst':>8}  {'worst at':24}{'noise':>7}"
    heads += f"{f'floor of {field.bands} bands':>18}"
    with_trilinear = rows[0].trilinear is not None
    lines = [
        f"Error of irradiance in % of the reference's RMS; {engine}",
        heads + (f"{'plain trilinear':>17}" if with_trilinear else ""),
    ]
    for row in rows:
        error = row.error
        at = ", ".join(f"{value:.3g}" for value in row.points.positions[error.worst_index])
        lines.append(
            f"{row.points.name:16}{error.points:7}{_percent(error.relative_rms):>10}{_percent(error.bias, True):>8}"
            f"{_percent(error.percentile_95):>8}{_percent(error.worst):>8}  {at:24}{_percent(row.noise):>7}"
            f"{_percent(row.floor.relative_rms):>18}"
            + (f"{_percent(row.trilinear.relative_rms):>17}" if row.trilinear else "")
        )
    for row in rows:
        if row.negative.count:
            lines.append(
                f"{row.points.name}: {row.negative.count} of {row.negative.values} values are below zero, lowest "
                f"{_percent(row.negative.lowest)}; perfect probes would have {row.negative_floor.count}, lowest "
                f"{_percent(row.negative_floor.lowest)}"
            )
    predicted = against_prediction(rows, field)
    if predicted:
        target, told, most, found = (_percent(predicted[key]) for key in ("target", "predicted", "at_most", "verified"))
        lines.append(f"probes: {found} verified, {told} predicted by the bake (at most {most}), {target} asked for")
        if predicted["between"] is not None:
            lines.append(
                f"free points: {_percent(predicted['between_verified'])} verified, "
                f"{_percent(predicted['between'])} predicted by the bake"
            )
    return "\n".join(lines)


def against_prediction(rows: list[Row], field: Field) -> dict | None:
    """What a bake that was given an error predicted, beside what was found; None for other bakes."""
    error = field.metadata.get("error")
    if not isinstance(error, dict) or error.get("predicted") is None:
        return None
    verified = {row.points.name: row.error.relative_rms for row in rows}
    return {
        "target": error["target"],
        "predicted": error["predicted"],
        "at_most": error["predicted_at_most"],
        "verified": verified["probes"],
        "between": error.get("between"),
        "between_verified": verified["free points"],
    }


def _percent(value: float, signed: bool = False) -> str:
    return f"{100 * value:{'+' if signed else ''}.2f}"
