# SPDX-License-Identifier: GPL-3.0-or-later
"""What relighting the gallery costs beside baking it: the table of docs/measurements.md, printed with ``-s``."""

import time
from dataclasses import replace

import bpy
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.session import BakeSession
from gridlight.cli.progress import Reporter
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import World
from gridlight.scene.gallery import build_gallery
from gridlight.scene.read import read_scene


def with_light(snapshot, **values):
    return replace(snapshot, lights=[replace(snapshot.lights[0], **values), *snapshot.lights[1:]])


def shifted_light(snapshot, offset):
    matrix = snapshot.lights[0].matrix.copy()
    matrix[:3, 3] += offset
    return with_light(snapshot, matrix=matrix)


def with_moved(snapshot, name, offset):
    vertices = snapshot.vertices.copy()
    mine = np.unique(snapshot.triangles[snapshot.object_index == snapshot.object_names.index(name)])
    vertices[mine] += offset
    return replace(snapshot, vertices=vertices)


CHANGES = {
    "a light moved by 36 cm": (lambda s: shifted_light(s, (0.3, 0.2, 0.0)), 0.35),
    "its colour, 5 %": (lambda s: with_light(s, color=tuple(1.05 * x for x in s.lights[0].color)), 0.3),
    "the world": (lambda s: replace(s, world=World((0.1, 0.1, 0.1))), 0.5),
    "a reflectance": (
        lambda s: replace(s, materials=[replace(s.materials[0], base_color=(0.5, 0.4, 0.3)), *s.materials[1:]]),
        0.5,
    ),
    "a plinth moved by 18 cm": (lambda s: with_moved(s, "Plinth 0.7 × 1", (0.15, 0.1, 0.0)), 1.2),
}


def timed(steps):
    """(processor seconds, seconds of the longest step) of following ``steps``."""
    longest, start = 0.0, time.process_time()
    last = start
    for _ in steps:
        now = time.process_time()
        longest, last = max(longest, now - last), now
    return time.process_time() - start, longest


@pytest.mark.nightly
def test_relighting_the_gallery(gpu_context):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    snapshot = read_scene(build_gallery(bpy.context.scene))
    volume = snapshot.volumes[0]
    grid, settings = Grid(volume.matrix, volume.resolution, volume.name), BakeSettings()
    for _warm in range(2):
        session = BakeSession(BakeJob(snapshot, grid, settings), Reporter(quiet=True))
        whole, longest = timed(session.bake())
    print(f"\nbake {whole:.2f} s, longest step {longest:.2f}")
    for name, (change, most) in CHANGES.items():
        timed(session.relight(change(snapshot)))  # the first one compiles shaders
        timed(session.relight(snapshot))
        seconds, longest = timed(session.relight(change(snapshot)))
        relit = session.result.relit
        print(
            f"{name:26s} {seconds:.2f} s, longest step {longest:.2f}; captured {relit.probes_captured} probes, "
            f"lamps {relit.lights_direct}, rays of {relit.patches_traced} of {relit.patches} patches, "
            f"{relit.iterations} iterations, {relit.hierarchy}"
        )
        assert seconds < most * whole
        timed(session.relight(snapshot))
