# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight diff``: how far two probe files of the same grid are apart."""

from __future__ import annotations

import numpy as np

from ..core.conventions import ACTIVE
from ..core.errors import InputError
from ..formats import probe_file

HELP = "how far two probe files of the same grid are apart"
NEEDS_BLENDER = NEEDS_GPU = False

_ARRAYS = ("coefficients", "state", "validity", "offset", "depth", "gradient")  # of a field: all that a lookup reads


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("first", metavar="A.exr")
    parser.add_argument("second", metavar="B.exr")


def run(args, reporter, should_stop):
    first, second = probe_file.read(args.first), probe_file.read(args.second)
    summary = compare(first, second)
    reporter.result(_text(args, summary))
    return summary, 0


def compare(first, second) -> dict:
    """Differences of two fields of one grid over the probes that are active in both.

    Per band the root mean square of the coefficients' difference, absolute and relative to that of ``first`` (None
    where that is zero). Where the number of bands differs, the missing ones count as zero. "identical" is about
    everything that a lookup reads, of all probes.

    Raises:
        InputError: the grids are not the same.
    """
    if first.grid.resolution != second.grid.resolution:
        shown = ["×".join(map(str, field.grid.resolution)) for field in (first, second)]
        raise InputError(f"the files hold different grids, {shown[0]} and {shown[1]}; compare bakes of one volume")
    extent = np.abs(first.grid.matrix[:3, :3]).max()
    if np.abs(first.grid.matrix - second.grid.matrix).max() > 1e-6 * extent:
        raise InputError("the files hold volumes at different places; compare bakes of one volume")
    both = (first.state == ACTIVE) & (second.state == ACTIVE)
    bands = max(first.bands, second.bands)
    values = [np.zeros((int(both.sum()), bands * bands, 3)) for _ in range(2)]
    for padded, field in zip(values, (first, second)):
        padded[:, : field.bands**2] = field.coefficients[both]
    difference = values[1] - values[0]
    per_band = []
    for band in range(bands):
        span = slice(band * band, (band + 1) ** 2)
        rms, scale = _rms(difference[:, span]), _rms(values[0][:, span])
        per_band.append({"band": band, "rms": rms, "relative": rms / scale if scale else None})
    worst = None
    if both.any():
        per_probe = np.sqrt(np.mean(difference**2, axis=(1, 2)))
        row = int(np.argmax(per_probe))
        flat = int(np.flatnonzero(both)[row])
        worst = {
            "node": first.grid.lattice()[flat].tolist(),
            "position": first.grid.positions()[flat].tolist(),
            "rms": float(per_probe[row]),
        }
    scale = _rms(values[0])
    return {
        "identical": all(np.array_equal(getattr(first, name), getattr(second, name)) for name in _ARRAYS),
        "compared": int(both.sum()),
        "states_differ": int((first.state != second.state).sum()),
        "rms": _rms(difference),
        "relative": _rms(difference) / scale if scale else None,
        "bands": per_band,
        "worst": worst,
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


def _text(args, summary: dict) -> str:
    def share(value):
        return "" if value is None else f"  ({100 * value:.4g} %)"

    lines = [
        f"{args.first} and {args.second}: {'identical' if summary['identical'] else 'different'}, "
        f"{summary['compared']} probes active in both, {summary['states_differ']} with another state"
    ]
    lines += [f"  band {row['band']}   rms {row['rms']:.6g}{share(row['relative'])}" for row in summary["bands"]]
    lines.append(f"  all      rms {summary['rms']:.6g}{share(summary['relative'])}")
    if summary["worst"]:
        lines.append(f"  worst    node {summary['worst']['node']}, rms {summary['worst']['rms']:.6g}")
    return "\n".join(lines)
