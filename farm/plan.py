# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm plan``: reads the scene once and writes down everything that shards need."""

from __future__ import annotations

import json
from pathlib import Path

from ..cli import arguments, bake
from ..core.errors import InputError
from ..formats.staging import StagedFolder
from . import container
from .job import VERSION
from .partition import divide

HELP = "reads a .blend and writes a job: scene, volumes, settings and shards"
NEEDS_BLENDER = NEEDS_GPU = True


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("file", metavar="FILE.blend")
    parser.add_argument("-o", "--output", metavar="JOB", required=True, help="folder of the job")
    bake.add_volume(parser)
    bake.add_settings(parser)
    parser.add_argument(
        "--frames", metavar="A-B", type=arguments.frames, help="a field for each of these frames (default: --frame)"
    )
    parser.add_argument("--frame", metavar="N", type=int, help="frame to bake (default: the file's current one)")
    parser.add_argument(
        "--shards",
        metavar="N",
        type=int,
        help="of each volume and frame; as many as there are blocks at most (default: one for each block)",
    )
    parser.add_argument("--no-calibration", action="store_true", help="do not measure how long shards will take")
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    """What can be refused before Blender starts."""
    args.relight, args.error = [], None
    bake.check(args)
    if args.frames and args.frame is not None:
        raise InputError("--frames and --frame exclude each other; give one")
    if args.shards is not None and args.shards < 1:
        raise InputError(f"--shards is {args.shards}; it must be 1 or more")


def run(args, reporter, should_stop):
    import bpy

    from ..cli import pipeline
    from ..cli.run_clock import RunClock
    from ..core.errors import Cancelled
    from ..gpu_shaders.context import device_description
    from ..scene.open_file import open_blend, set_frame
    from ..scene.read import read_scene

    check(args)
    settings = bake.settings_from(args)
    job = Path(args.output)
    stopwatch = RunClock()
    reporter.phase("read")
    scene = open_blend(args.file)
    pipeline.start_gpu(reporter, stopwatch)
    frames = args.frames or [args.frame]
    plan: dict = {
        "version": VERSION,
        "generator": _generator(),
        "title": Path(args.file).name,
        "settings": settings.as_dict(),
        "device": device_description(),
        "blender": bpy.app.version_string,
        "frames": [],
        "shards": [],
    }
    reporter.phase("frames", len(frames))
    blocks, first = 0, None
    for number, frame in enumerate(frames):
        if should_stop():
            raise Cancelled("cancelled")
        if frame is not None:
            set_frame(scene, frame)
        snapshot = read_scene(scene)
        pipeline.check_snapshot(snapshot, reporter)
        entry, groups = _plan_frame(args, scene, snapshot, settings, job / "objects")
        plan["frames"].append(entry)
        for volume, active in enumerate(groups):
            blocks += len(active)
            plan["shards"] += [[number, volume, list(part)] for part in divide(active, args.shards)]
        first = first or snapshot
        reporter.advance()
    path = _write_plan(job, plan)
    summary = _summary(path, plan, blocks)
    if args.shards and args.shards * sum(len(f["volumes"]) for f in plan["frames"]) > len(plan["shards"]):
        reporter.note(
            f"{args.shards} shards were asked for, but there are only {blocks} blocks in all: "
            f"the job has {len(plan['shards'])} shards. A smaller --block makes more"
        )
    if not args.no_calibration:
        summary["cost"] = _tell_cost(job, plan, settings, first, bake.choose_grids(args, first), reporter, should_stop)
    return summary, 0


def _tell_cost(job: Path, plan: dict, settings, snapshot, grids, reporter, should_stop) -> dict:
    """Measures a little, prints what the job will cost and keeps it beside the plan, which holds no times."""
    from .calibration import calibrate
    from .cost import table, totals

    reporter.phase("calibration")
    model = calibrate(snapshot, grids[0], settings, should_stop)
    for line in table(model, plan):
        reporter.result(line)
    cost = totals(model, plan)
    with StagedFolder(job) as staged:
        staged.path("cost.json").write_text(json.dumps(cost, indent=1) + "\n", encoding="utf-8")
    return cost


def _plan_frame(args, scene, snapshot, settings, objects: Path) -> tuple[dict, list[dict[int, int]]]:
    """The frame's entry, and of each volume the number of probes that capture by block."""
    import numpy as np

    from ..bake.capture_choice import choose_capture
    from ..bake.cull import cull
    from ..bake.result import BakeResult, check_scene
    from ..core.blocks import cut
    from ..core.conventions import CULLED
    from ..core.probe_edits import ProbeEdits
    from ..formats import probe_file, probe_metadata
    from ..scene.probe_objects import edits_of
    from .scene_file import write_scene

    volumes, groups, checked = [], [], BakeResult()
    check_scene(snapshot, checked)
    for grid in bake.choose_grids(args, snapshot):
        probe_file.check_size(grid, settings.bands)
        edits = edits_of(scene, grid) or ProbeEdits.none(grid)
        state = cull(snapshot, grid, settings, edits)
        active = [int((state[block.nodes()] != CULLED).sum()) for block in cut(grid, settings.block)]
        layout = container.write(
            objects, "volume", {}, {"state": state, "disabled": edits.disabled, "offset": edits.offset}
        )
        volumes.append(
            {
                "name": grid.name,
                "matrix": np.asarray(grid.matrix, float).tolist(),
                "resolution": [int(count) for count in grid.resolution],
                "layout": layout.name,
                "active": active,
                "capture": choose_capture(settings, len(snapshot.triangles), int((state != CULLED).sum()))[0],
                "warnings": checked.warnings,
            }
        )
        groups.append({index: count for index, count in enumerate(active) if count or len(active) == 1})
    entry = {
        "frame": int(snapshot.frame),
        "scene_name": snapshot.name,
        "scene_hash": probe_metadata.scene_hash(snapshot),
        "warnings": list(snapshot.warnings),
        "scene": write_scene(objects, snapshot),
        "volumes": volumes,
    }
    return entry, groups


def _write_plan(job: Path, plan: dict) -> Path:
    """Raises InputError where the folder holds another plan."""
    text = json.dumps(plan, sort_keys=True, allow_nan=False, indent=1) + "\n"
    others = list(job.glob("plan-*.json"))
    path = container.write_bytes(job, "plan", [text.encode()], ".json")
    if any(other != path for other in others):
        path.unlink()
        raise InputError(f"{job} holds the plan of another bake; name an empty folder with -o, or remove that one")
    return path


def _summary(path: Path, plan: dict, blocks: int) -> dict:
    return {
        "job": str(path.parent),
        "plan": container.hash_in(path),
        "frames": len(plan["frames"]),
        "volumes": len(plan["frames"][0]["volumes"]),
        "blocks": blocks,
        "shards": len(plan["shards"]),
        "device": plan["device"],
        "settings": plan["settings"],
    }


def _generator() -> str:
    from ..formats.probe_metadata import program_version

    return f"Gridlight {program_version()}"
