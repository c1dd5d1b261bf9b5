# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight export``: probes as files that an engine loads. Needs Blender only for ``--scene``."""

from __future__ import annotations

import json
import time

from ..core.errors import Cancelled, InputError
from ..formats import probe_file
from ..formats.export import INACTIVE, LAYOUTS, TARGETS, ExportOptions, check_path, export
from ..formats.export_lattice import AXES, axes_matrix
from ..formats.export_numbers import PRECISIONS
from ..formats.export_three_scene import describe
from .arguments import counts

HELP = "probes as files that an engine loads"
NEEDS_GPU = False


def NEEDS_BLENDER(args) -> bool:
    return args.scene is not None


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("probes", metavar="PROBES.exr")
    parser.add_argument("--to", required=True, metavar="NAME", help=", ".join(TARGETS))
    parser.add_argument(
        "-o", "--output", required=True, metavar="PATH", help="a folder, or the file to write where it is one"
    )
    parser.add_argument(
        "--axes", metavar="NAME", help=f"{', '.join(AXES)}, or the target's X,Y,Z like x,z,-y (default: the engine's)"
    )
    parser.add_argument("--scale", type=float, default=1.0, metavar="S", help="target units per metre (default 1)")
    parser.add_argument("--bands", type=int, metavar="N", help="keep only the first N bands")
    parser.add_argument(
        "--window", default="none", metavar="W", help="against ringing: none, auto, hann:W or lanczos:W (default none)"
    )
    parser.add_argument("--precision", metavar="P", help=f"{' or '.join(PRECISIONS)} (default: the engine's)")
    parser.add_argument(
        "--inactive", default="fill", metavar="HOW", help=f"culled and invalid probes: {' or '.join(INACTIVE)}"
    )
    parser.add_argument("--gain", type=float, default=1.0, metavar="F", help="factor on all light (default 1)")
    parser.add_argument(
        "--refine",
        type=int,
        default=1,
        metavar="N",
        help="three: N³ cells of the atlas for each, so that it looks closer to surfaces (default 1)",
    )
    parser.add_argument("--scene", metavar="FILE.blend", help="three: put its GLB and lamps beside the probes")
    parser.add_argument("--probe", type=counts, metavar="I,J,K", help="of one probe: which (default: near the middle)")
    parser.add_argument("--layout", default="cross", metavar="L", help=f"cubemap: {', '.join(LAYOUTS)}")
    parser.add_argument("--size", type=int, default=64, metavar="N", help="cubemap: edge of a face, panorama's height")
    parser.add_argument("--quiet", action="store_true", help="no progress")


def check(args) -> None:
    """Raises InputError for what can be told without reading anything."""
    check_path(args.to, args.output)
    _options(args)
    if args.axes is not None:
        axes_matrix(args.axes)
    if args.scene is not None and (args.to != "three" or (args.axes or "y-up") != "y-up" or args.scale != 1):
        raise InputError("--scene puts a GLB beside probes in metres, Y up: use it with --to three alone")


def run(args, reporter, should_stop):
    started = time.perf_counter()
    check(args)
    field = probe_file.read(args.probes)
    if should_stop():
        raise Cancelled()
    extra = _scene_beside(args, reporter) if args.scene is not None else lambda job: {}
    reporter.phase(f"export to {args.to}")
    result = export(field, args.to, args.output, _options(args), args.probes, extra)
    reporter.advance(field.grid.count)
    for warning in result.warnings:
        reporter.warn(warning)
    for loss in result.does_not_carry:
        reporter.note(f"{args.to} does not carry {loss}")
    return {
        "to": args.to,
        "probes": field.grid.count,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "files": result.files,
        "does_not_carry": result.does_not_carry,
        "resampled": result.conventions["resampled"],
        "warnings": reporter.warnings,
    }, 0


def _options(args) -> ExportOptions:
    return ExportOptions(
        axes=args.axes,
        scale=args.scale,
        bands=args.bands,
        window=args.window,
        precision=args.precision,
        inactive=args.inactive,
        gain=args.gain,
        refine=args.refine,
        probe=args.probe,
        layout=args.layout,
        size=args.size,
    )


def _scene_beside(args, reporter):
    """What stages scene.glb and scene.json with the rest."""
    from ..scene.gltf_export import export_glb
    from ..scene.open_file import open_blend
    from ..scene.read import read_scene

    reporter.phase("read the scene")
    snapshot = read_scene(open_blend(args.scene))

    def stage(job) -> dict:
        reporter.phase("scene as GLB")
        export_glb(job.folder.path("scene.glb"))
        about = describe(snapshot, axes_matrix("y-up"), "scene.glb")
        job.folder.path("scene.json").write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
        return {"scene": {"model": "scene.glb", "lamps": len(about["lamps"])}}

    return stage
