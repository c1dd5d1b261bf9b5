# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bake``: from a .blend to probe files, pictures and a report."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.error_budget import ErrorGoal
from ..core.errors import Cancelled, InputError
from ..core.grid import Grid
from ..core.settings import CAPTURES, BakeSettings
from ..core.snapshot import Volume
from ..formats import probe_file
from ..formats.staging import StagedFolder
from . import arguments

HELP = "bakes the probe volumes of a .blend, or one fitted to its scene"
NEEDS_BLENDER = NEEDS_GPU = True


def add_arguments(parser, in_blender: bool) -> None:
    if in_blender:
        parser.add_argument("file", metavar="FILE.blend", nargs="?", help="instead of the file that Blender has open")
    else:
        parser.add_argument("file", metavar="FILE.blend")
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder for the results")
    add_volume(parser)
    add_goal(parser)
    add_settings(parser)
    parser.add_argument("--frame", metavar="N", type=int, help="frame to bake (default: the file's current one)")
    parser.add_argument(
        "--relight",
        metavar="CHANGED.blend|N",
        action="append",
        default=[],
        help="afterwards light another state of the scene, a file or a frame, computing only what changed; repeatable",
    )
    arguments.add_pictures(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def add_volume(parser) -> None:
    """The options from which ``choose_grids`` makes grids."""
    volume = parser.add_argument_group("volume (default: those of the file, or one fitted to the scene)")
    volume.add_argument("--min", metavar="X,Y,Z", type=arguments.point, help="corner of an axis-aligned volume, metres")
    volume.add_argument("--max", metavar="X,Y,Z", type=arguments.point, help="the opposite corner")
    volume.add_argument("--resolution", metavar="NX,NY,NZ", type=arguments.counts, help="probes per axis, 1 to 256")
    volume.add_argument("--spacing", metavar="M", type=arguments.length, help="or the distance between probes, metres")


def add_goal(parser) -> None:
    """The option that becomes an ErrorGoal."""
    parser.add_argument(
        "--error",
        metavar="T",
        type=float,
        help="relative error of irradiance at probes to aim for, such as 0.02: face size, bands, tolerance and samples "
        "that are not given are then chosen, the cheapest that meet it",
    )


def add_settings(parser) -> None:
    """The options that become a BakeSettings, with its defaults."""
    standard = BakeSettings()
    group = parser.add_argument_group("bake")
    group.add_argument(
        "--bands",
        metavar="1..4",
        type=int,
        action=arguments.Given,
        default=standard.bands,
        help="spherical-harmonic bands; a fourth adds nothing to diffuse light (default %(default)s)",
    )
    group.add_argument(
        "--face",
        metavar="N",
        type=int,
        action=arguments.Given,
        default=standard.face,
        help="texels per cube face edge (default %(default)s)",
    )
    group.add_argument(
        "--bounces",
        metavar="N|auto",
        type=arguments.bounces,
        action=arguments.Given,
        default=standard.bounces,
        help="light iterations; auto: until the tolerance is met (default auto)",
    )
    group.add_argument(
        "--tolerance",
        metavar="T",
        type=float,
        action=arguments.Given,
        default=standard.tolerance,
        help="relative energy still missing when iterations stop (default %(default)s)",
    )
    group.add_argument(
        "--gather",
        metavar="N",
        type=int,
        action=arguments.Given,
        default=standard.gather,
        help="bounces really traced before patches are read (default %(default)s)",
    )
    group.add_argument(
        "--samples",
        metavar="N",
        type=int,
        action=arguments.Given,
        default=standard.samples,
        help="times the rays and the samples of light that a patch takes (default %(default)s)",
    )
    group.add_argument(
        "--capture", choices=CAPTURES, default=standard.capture, help="how probes see (default %(default)s)"
    )
    group.add_argument(
        "--seed", metavar="N", type=int, default=standard.seed, help="of the sampling (default %(default)s)"
    )
    group.add_argument(
        "--deringing",
        action="store_true",
        help="flatten the probes whose series makes irradiance negative, each as little as it takes",
    )
    group.add_argument("--keep-all", action="store_true", help="bake every probe, cull none")
    group.add_argument(
        "--memory",
        metavar="MIB",
        type=int,
        default=standard.memory_mib,
        help="limit for GPU textures of the capture (default %(default)s)",
    )
    group.add_argument(
        "--block",
        metavar="N",
        type=int,
        default=standard.block,
        help="most probes that share patches of surface; larger grids are baked in blocks (default %(default)s)",
    )


def settings_from(args) -> BakeSettings:
    """Raises InputError for values out of range."""
    return BakeSettings(
        bands=args.bands,
        face=args.face,
        bounces=args.bounces,
        tolerance=args.tolerance,
        gather=args.gather,
        samples=args.samples,
        capture=args.capture,
        seed=args.seed,
        keep_all=args.keep_all,
        memory_mib=args.memory,
        block=args.block,
        deringing=args.deringing,
    )


def goal_from(args) -> ErrorGoal | None:
    """The error that the bake is asked for, if it is. Raises InputError for one out of range."""
    return None if args.error is None else ErrorGoal(args.error, getattr(args, "given", frozenset()))


def check(args) -> None:
    """What can be refused before Blender starts."""
    settings_from(args)
    goal_from(args)
    if (args.min is None) != (args.max is None):
        raise InputError("--min and --max belong together; give both or neither")
    if args.resolution and args.spacing:
        raise InputError("--resolution and --spacing exclude each other; give one")
    if args.min is not None:
        if not (args.resolution or args.spacing):
            raise InputError("--min and --max need --resolution NX,NY,NZ or --spacing M")
        for grid in choose_grids(args, None):
            probe_file.check_size(grid, args.bands)
    elif args.resolution:
        Grid(np.eye(4), args.resolution)
    states = [state for state in args.relight if not is_frame(state)]
    arguments.check_exists(*(states if args.file is None else [args.file, *states]))


def is_frame(state: str) -> bool:
    """Whether ``state``, a value of --relight, is a number of a frame and not a file."""
    return state.removeprefix("-").isdigit() and not Path(state).exists()


def run(args, reporter, should_stop):
    import bpy

    from ..bake.bake_job import BakeJob
    from ..scene.open_file import open_blend, set_frame
    from ..scene.probe_objects import edits_of
    from ..scene.read import read_scene
    from ..scene.volumes import eevee_volumes
    from . import pipeline
    from .relighting import relight_all
    from .result_files import NOT_CONVERGED
    from .run_clock import RunClock

    check(args)
    settings = settings_from(args)
    stopwatch = RunClock()
    with StagedFolder(args.output) as folder:
        with stopwatch("read"):
            reporter.phase("read")
            scene = bpy.context.scene if args.file is None else open_blend(args.file)
            if args.frame is not None:
                set_frame(scene, args.frame)
            snapshot = read_scene(scene)
        pipeline.check_snapshot(snapshot, reporter)
        grids = choose_grids(args, snapshot)
        if not snapshot.volumes and args.min is None and (others := eevee_volumes(scene)):
            reporter.warn(
                f"EEVEE's light probe volumes ({', '.join(others)}) are left alone, a volume was fitted to the scene; "
                "add one with Add > Light Probe > Gridlight Volume, or give --min and --max"
            )
        if should_stop():
            raise Cancelled("cancelled")
        pipeline.start_gpu(reporter, stopwatch)
        jobs = [BakeJob(snapshot, grid, settings, edits_of(scene, grid)) for grid in grids]
        kept: list | None = [] if args.relight else None
        results = pipeline.bake_volumes(jobs, reporter, should_stop, stopwatch, goal_from(args), kept)
        title = Path(args.file or bpy.data.filepath or scene.name).name
        summary, status = pipeline.write_results(
            title, snapshot, settings, results, folder, reporter, should_stop, stopwatch, args.pictures
        )
        if args.relight:
            summary["relight"], settled = relight_all(args, kept, folder, reporter, should_stop, stopwatch)
            summary["files"] += [entry["file"] for entry in summary["relight"]]
            summary["seconds"] = stopwatch.totals()
            status = status if settled else NOT_CONVERGED
        return summary, status


def choose_grids(args, snapshot) -> list[Grid]:
    """The volumes to bake: from the options, from the file, or one fitted to the scene.

    ``--resolution`` and ``--spacing`` also apply to volumes of the file.
    """
    if args.min is not None:
        box = Grid.from_bounds(args.min, args.max, (1, 1, 1))
        volumes = [Volume(box.name, box.matrix, box.resolution)]
    elif snapshot.volumes:
        volumes = snapshot.volumes
    else:
        from ..scene.volume_fit import fit_volume

        return [fit_volume(snapshot, args.spacing, args.resolution)]
    return [Grid(volume.matrix, _resolution(args, volume), volume.name) for volume in volumes]


def _resolution(args, volume: Volume) -> tuple[int, int, int]:
    if args.spacing is None:
        return args.resolution or volume.resolution
    extent = 2 * np.linalg.norm(volume.matrix[:3, :3], axis=0)
    cells = np.rint(np.minimum(extent / args.spacing, 1e6))  # Grid refuses what is too many, in plain numbers
    nx, ny, nz = (int(count) + 1 for count in cells)
    return nx, ny, nz
