# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight demo``: builds the gallery, places its probes, bakes it and shows what came out."""

from __future__ import annotations

from ..core.grid import Grid
from ..formats.staging import StagedFolder
from . import bake

HELP = "builds, bakes and shows the gallery"
NEEDS_BLENDER = NEEDS_GPU = True


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("-o", "--output", metavar="DIR", required=True, help="folder for the results")
    bake.add_goal(parser)
    bake.add_settings(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    """What can be refused before Blender starts."""
    bake.settings_from(args)
    bake.goal_from(args)


def run(args, reporter, should_stop):
    import bpy

    from ..bake.bake_job import BakeJob
    from ..scene.gallery import build_gallery
    from ..scene.probe_objects import place_probes
    from ..scene.read import read_scene
    from . import pipeline
    from .run_clock import RunClock

    settings = bake.settings_from(args)
    stopwatch = RunClock()
    with StagedFolder(args.output) as folder:
        with stopwatch("setup"):
            reporter.phase("build")
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            scene = build_gallery(bpy.context.scene)
        with stopwatch("read"):
            reporter.phase("read")
            snapshot = read_scene(scene)
        pipeline.check_snapshot(snapshot, reporter)
        grids = [Grid(volume.matrix, volume.resolution, volume.name) for volume in snapshot.volumes]
        pipeline.start_gpu(reporter, stopwatch)
        jobs = [BakeJob(snapshot, grid, settings) for grid in grids]
        results = pipeline.bake_volumes(jobs, reporter, should_stop, stopwatch, bake.goal_from(args))
        with stopwatch("write"):
            for volume, result in zip(snapshot.volumes, results):
                place_probes(scene, result.field.grid, result.field.state, bpy.data.objects.get(volume.name))
            blend = folder.path("gallery.blend").absolute()
            bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True, compress=True)
        return pipeline.write_results("Gallery", snapshot, settings, results, folder, reporter, should_stop, stopwatch)
