# SPDX-License-Identifier: GPL-3.0-or-later
"""How sharp visibility is and how far points are moved before it is asked, against other choices: errors against Cycles
in rooms that no setting was tuned to, and light that is read behind a wall.

``scripts/test 5.2 -- tests/blender/test_visibility_choice.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import measured_leaks
import measured_rooms
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli import verify, verify_points
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_measure import Reference, measure
from gridlight.core import lookup, measures
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]

POINTS, SAMPLES, HEIGHT = 24, 16, 32
SLACK = 1.08  # times the error of the best other choice that leaks as little: so well these points tell them apart


CHOICES = {
    "as it is": {},
    "no visibility": {"visibility": lambda field, nodes, points, normals: np.ones(nodes.shape)},
    "6th power": {"_SHARPNESS": 6},
    "32nd power": {"_SHARPNESS": 32},
    "not moved": {"OFF_SURFACE": 0.0},
    "moved by 0.02 of the distance": {"OFF_SURFACE": 0.02},
    "moved by 0.09 of the distance": {"OFF_SURFACE": 0.09},
}


@pytest.mark.gpu
def test_no_other_choice_errs_less_and_leaks_as_little(gpu_context, monkeypatch):
    errors = {name: {"free points": [], "surface points": []} for name in CHOICES}
    for room in measured_rooms.ROOMS:
        field, rows = room_rows(room)
        for name, choice in CHOICES.items():
            with monkeypatch.context() as patch:
                for attribute, value in choice.items():
                    patch.setattr(lookup, attribute, value)
                for row in rows:
                    errors[name][row.points.name].append(error_of(field, row))
    leaks = {name: [] for name in CHOICES}
    for _where, inset, resolution in measured_leaks.VOLUMES:
        field = measured_leaks.bake(measured_leaks.inset_by(inset, resolution))
        for name, choice in CHOICES.items():
            with monkeypatch.context() as patch:
                for attribute, value in choice.items():
                    patch.setattr(lookup, attribute, value)
                leaks[name].append(measured_leaks.leak(field).largest_mean)
    figures = {
        name: (*(float(np.exp(np.log(each).mean())) for each in kinds.values()), max(leaks[name]))
        for name, kinds in errors.items()
    }
    print("\n| | free places | surfaces | largest leak |\n|---|---|---|---|")
    for name, row in figures.items():
        print(f"| {name} | " + " | ".join(f"{100 * value:.2f}" for value in row) + " |")
    free, surfaces, _leak = figures["as it is"]
    others = [row for row in figures.values() if row[2] < measured_leaks.MOST_LEAK]
    assert free < SLACK * min(row[0] for row in others) and surfaces < SLACK * min(row[1] for row in others)


def room_rows(name):
    """The room's field, and what Cycles finds at free places and on surfaces."""
    scene, grid = measured_rooms.ROOMS[name]()
    scene.view_layers[0].update()
    snapshot, quiet = read_scene(scene), Reporter(quiet=True)
    field = run_bake(BakeJob(snapshot, grid, BakeSettings()), quiet, lambda: False).field
    space = verify_points.FreeSpace(snapshot, verify_points.cycles_light(scene))
    kinds = [kind for kind in verify.choose_points(field, space, POINTS, 0) if kind.nodes is None]
    return field, measure(field, kinds, Reference(scene, SAMPLES, HEIGHT, None, quiet, lambda: False), quiet, False)


def error_of(field, row):
    count = row.points.normals.shape[1]
    points = np.repeat(row.points.positions, count, axis=0)
    found = lookup.irradiance(field, points, row.points.normals.reshape(-1, 3)).reshape(row.reference.shape)
    return measures.compare(found, row.reference).relative_rms
