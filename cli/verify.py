# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight verify``: how far a probe file is from Cycles, which knows nothing of it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core import lookup, measures
from ..core import spherical_harmonics as sh
from ..core.conventions import ACTIVE
from ..core.errors import Cancelled, InputError
from ..core.field import Field
from ..core.panorama import panorama_irradiance, project_panorama
from ..formats import probe_file

HELP = "compares a probe file with Cycles panoramas of its scene"
NEEDS_BLENDER, NEEDS_GPU = True, False

_SECOND_SEED = 1_000_003  # panoramas take consecutive seeds from their first: the two series never meet


@dataclass(frozen=True)
class Points:
    """Points of one kind; every point is asked for K irradiances.

    ``normals`` is (N, K, 3): six axes in free space, its own normal for a point on a surface.
    """

    name: str
    positions: np.ndarray  # (N, 3) world metres
    normals: np.ndarray


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    points: Points
    error: measures.ErrorFigures  # of the probe file's lookup
    floor: measures.ErrorFigures  # of a perfect probe with the file's bands, standing at the point itself
    noise: float  # of the reference

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        worst = self.points.positions[self.error.worst_index]
        return {
            **self.error.as_dict(),
            "worst_position": [round(float(value), 6) for value in worst],
            "noise": self.noise,
            "floor": self.floor.as_dict(),
        }


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
    for path in (args.file, args.probes):
        if not Path(path).exists():
            raise InputError(f"{path}: no such file")


def run(args, reporter, should_stop):
    from ..formats.probe_metadata import scene_hash
    from ..scene.open_file import open_blend
    from ..scene.read import read_scene

    check(args)
    started = time.perf_counter()
    field = probe_file.read(args.probes)
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
    kinds = choose_points(field, snapshot, args.points, args.seed)
    rows = measure(scene, field, kinds, args.spp, args.height, frame, reporter, should_stop)
    reporter.result(table(rows, field, args.spp, args.height))
    summary = {
        "points": {row.points.name: row.as_dict() for row in rows},
        "bands": field.bands,
        "reference": {
            "engine": "Cycles",
            "width": 2 * args.height,
            "height": args.height,
            "samples": args.spp,
            "seeds": 2,
        },
        "seed": args.seed,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "warnings": reporter.warnings,
    }
    return summary, 0


def choose_points(field: Field, snapshot, count: int, seed: int) -> list[Points]:
    """Active probes, random free points and random surface points in the volume of ``field``, up to ``count`` of each.

    Raises:
        InputError: no active probe stands in free space.
    """
    from . import verify_points

    random = np.random.default_rng(seed)
    space = verify_points.FreeSpace(snapshot)
    nodes = (field.grid.positions() + field.offset)[field.state == ACTIVE]
    nodes = nodes[space.is_free(nodes)]
    if not len(nodes):
        raise InputError(
            f"{field.grid.name}: none of its active probes stands in free space of this scene; "
            "name the scene that was baked"
        )
    nodes = nodes[np.sort(random.permutation(len(nodes))[:count])]
    free = verify_points.free_points(space, field.grid, count, seed)
    surface, normals = verify_points.surface_points(space, field.grid, count, seed)
    six = verify_points.SIX_NORMALS
    kinds = [
        Points("probes", nodes, np.broadcast_to(six, (len(nodes), *six.shape))),
        Points("free points", free, np.broadcast_to(six, (len(free), *six.shape))),
    ]
    if len(surface):
        kinds.append(Points("surface points", surface, normals[:, None]))
    return kinds


def measure(
    scene, field: Field, kinds: list[Points], samples: int, height: int, frame: int | None, reporter, should_stop
) -> list[Row]:
    """Renders all points with two seeds and compares. See ``Row`` for what comes out.

    Raises:
        Cancelled: ``should_stop`` returned true between two panoramas.
        InputError: a kind of points is black in the reference.
    """
    from ..scene.cycles_reference import render_panoramas

    def progress(_done, _total):
        reporter.advance(1)
        if should_stop():
            raise Cancelled()

    positions = np.concatenate([kind.positions for kind in kinds])
    reporter.phase("Cycles", 2 * len(positions))
    images = [
        render_panoramas(scene, positions, 2 * height, height, samples, seed, frame=frame, progress=progress)
        for seed in (1, _SECOND_SEED)
    ]
    reporter.phase("compare")
    rows = []
    first = 0
    for kind in kinds:
        part = slice(first, first + len(kind.positions))
        first = part.stop
        rows.append(_compare(field, kind, images[0][part], images[1][part]))
    return rows


def _compare(field: Field, kind: Points, first: np.ndarray, second: np.ndarray) -> Row:
    """``first`` and ``second`` are (N, H, W, 3) panoramas of the same points with different seeds."""
    series = [
        np.stack([panorama_irradiance(image, normals) for image, normals in zip(images, kind.normals)])
        for images in (first, second)
    ]
    reference = np.mean(series, axis=0)
    if not reference.any():
        raise InputError(
            f"{kind.name}: Cycles sees no light at any of them; give the scene light before it is verified"
        )
    count = kind.normals.shape[1]
    ours = lookup.irradiance(field, np.repeat(kind.positions, count, axis=0), kind.normals.reshape(-1, 3))
    perfect = np.stack([project_panorama((a + b) / 2, field.bands) for a, b in zip(first, second)])
    floor = sh.irradiance(perfect[:, None], kind.normals)
    return Row(
        kind,
        measures.compare(ours.reshape(reference.shape), reference),
        measures.compare(floor, reference),
        measures.noise_of_mean(*series),
    )


def table(rows: list[Row], field: Field, samples: int, height: int) -> str:
    """The rows as text, errors in percent of the reference's RMS."""
    lines = [
        f"Error of irradiance in % of the reference's RMS; Cycles {2 * height}×{height}, 2 × {samples} samples",
        f"{'':16}{'points':>7}{'rel. RMS':>10}{'bias':>8}{'95th':>8}{'worst':>8}  {'worst at':24}{'noise':>7}"
        f"{f'floor of {field.bands} bands':>18}",
    ]
    for row in rows:
        error = row.error
        at = ", ".join(f"{value:.3g}" for value in row.points.positions[error.worst_index])
        lines.append(
            f"{row.points.name:16}{error.points:7}{_percent(error.relative_rms):>10}{_percent(error.bias, True):>8}"
            f"{_percent(error.percentile_95):>8}{_percent(error.worst):>8}  {at:24}{_percent(row.noise):>7}"
            f"{_percent(row.floor.relative_rms):>18}"
        )
    return "\n".join(lines)


def _percent(value: float, signed: bool = False) -> str:
    return f"{100 * value:{'+' if signed else ''}.2f}"
