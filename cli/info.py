# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight info``: what a probe file holds."""

from __future__ import annotations

import numpy as np

from ..core.conventions import ACTIVE, LUMINANCE
from ..core.field import state_counts
from ..core.probe_states import invalid_counts, invalid_in_words
from ..core.ringing import ringing
from ..core.spherical_harmonics import Y0
from ..formats import probe_file

HELP = "what a probe file holds"
NEEDS_BLENDER = NEEDS_GPU = False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("probes", metavar="PROBES.exr")


def run(args, reporter, should_stop):
    summary = summarise(probe_file.read(args.probes))
    reporter.result(_text(args.probes, summary))
    return summary, 0


def summarise(field) -> dict:
    """What ``info`` says about ``field``, as plain values. Lengths in metres, radiance in scene units."""
    grid = field.grid
    active = field.state == ACTIVE
    mean = field.coefficients[active, 0] @ LUMINANCE * Y0
    corners = np.array([[x, y, z, 1.0] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) @ grid.matrix.T
    summary = {
        **field.metadata,
        "probes": state_counts(field.state),
        "invalid_because": invalid_counts([field]),
        "bounds": {"min": corners[:, :3].min(axis=0).tolist(), "max": corners[:, :3].max(axis=0).tolist()},
        "spacing": grid.cell_size().tolist(),
        "mean_radiance": None
        if not len(mean)
        else {"min": float(mean.min()), "mean": float(mean.mean()), "max": float(mean.max())},
        "ringing": ringing(field.coefficients[active]).as_dict(),
    }
    summary.setdefault("warnings", [])
    return summary


def _text(path: str, summary: dict) -> str:
    def triple(values):
        return " × ".join(f"{value:.4g}" for value in values)

    probes, light = summary["probes"], summary["mean_radiance"]
    why = f": {invalid_in_words(summary['invalid_because'])}" if probes["invalid"] else ""
    low, high = (" ".join(f"{value:.4g}" for value in summary["bounds"][corner]) for corner in ("min", "max"))
    major, minor = summary["format_version"]
    lines = [
        f"{path}: probe file {major}.{minor}, volume '{summary['volume']['name']}'",
        f"  probes     {triple(summary['resolution'])} = {probes['total']}: {probes['active']} active, "
        f"{probes['culled']} culled, {probes['invalid']} invalid{why}",
        f"  box        {low}  to  {high} m, spacing {triple(summary['spacing'])} m",
        f"  bands      {summary['bands']}",
    ]
    if light:
        lines.append(
            f"  radiance   mean per active probe {light['min']:.4g} to {light['max']:.4g}, average {light['mean']:.4g}"
        )
    rings = summary["ringing"]
    if rings["negative"]:
        lines.append(
            f"  ringing    irradiance falls below zero at {rings['negative']} of {rings['probes']} active probes, "
            f"lowest {100 * rings['lowest']:.3g} % of the probe's mean; bake with --deringing to flatten them"
        )
    if "device" in summary:
        lines.append(f"  device     {summary['device']}")
    if isinstance(summary.get("settings"), dict):
        lines.append("  settings   " + ", ".join(f"{key} {value}" for key, value in summary["settings"].items()))
    if "scene_hash" in summary:
        lines.append(f"  scene      {summary['scene_hash']}")
    lines += [f"  warning    {' '.join(str(text).split())}" for text in summary["warnings"]]
    return "\n".join(lines)
