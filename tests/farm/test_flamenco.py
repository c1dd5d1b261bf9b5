# SPDX-License-Identifier: GPL-3.0-or-later
"""The Flamenco job type, compiled by Node with a stub of the author API; its tasks are run here, in an order that only
dependencies decide. It has not been run inside Flamenco."""

import json
import random
import shutil
import subprocess
from pathlib import Path

import pytest

from .conftest import OPTIONS, ROOT

SCRIPT = ROOT / "farm" / "flamenco" / "gridlight_bake.js"


def compiled(**settings):
    node = shutil.which("node")
    assert node, "Node is needed to compile the job type; install nodejs"
    command = [node, str(Path(__file__).with_name("flamenco_compile.js")), str(SCRIPT), json.dumps(settings)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_tasks_and_barriers():
    tasks = compiled(blendfile="/a b.blend", job_folder="/job", tasks=3, frames="1-5", options="--face  8")
    names = [task["name"] for task in tasks]
    assert len(names) == len(set(names)) == 9
    plan, votes, verdict, light, merge = tasks[0], tasks[1:4], tasks[4], tasks[5:8], tasks[8]
    assert plan["dependencies"] == [] and all(task["dependencies"] == [0] for task in votes)
    assert verdict["dependencies"] == [1, 2, 3] and all(task["dependencies"] == [4] for task in light)
    assert merge["dependencies"] == [5, 6, 7]
    assert plan["commands"] == [
        {
            "name": "exec",
            "parameters": {
                "exe": "gridlight",
                "args": ["farm", "plan", "/a b.blend", "-o", "/job", "--frames", "1-5", "--face", "8"],
            },
        }
    ]
    assert light[2]["commands"][0]["parameters"]["args"] == [
        *("farm", "shard", "/job", "--iteration", "1", "--shard", "2/3"),
    ]


@pytest.mark.nightly
def test_compiled_tasks_bake_what_a_plain_bake_does(farm_scene, farm_command, plain, tmp_path):
    job = tmp_path / "job"
    options = " ".join([*OPTIONS, "--no-calibration", "--quiet"])
    tasks = compiled(blendfile=str(farm_scene), job_folder=str(job), tasks=3, options=options)
    order, waiting = random.Random(0), set(range(len(tasks)))
    while waiting:
        ready = [i for i in sorted(waiting) if not waiting & set(tasks[i]["dependencies"])]
        number = order.choice(ready)
        for command in tasks[number]["commands"]:
            assert command["name"] == "exec" and command["parameters"]["args"][0] == "farm"
            done = farm_command(*command["parameters"]["args"][1:])
            assert done.returncode == 0, done.stderr
        waiting.remove(number)
    assert (job / "result" / "probes.exr").read_bytes() == plain()
