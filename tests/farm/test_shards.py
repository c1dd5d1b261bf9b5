# SPDX-License-Identifier: GPL-3.0-or-later
"""Shards and their merge against the plain bake, byte for byte; damaged, stale and missing outputs."""

import os

import numpy as np
import pytest
from gridlight.cli import bake as bake_command
from gridlight.cli.progress import Reporter
from gridlight.core.conventions import INVALID
from gridlight.core.errors import InputError
from gridlight.core.probe_states import invalid_counts
from gridlight.farm import container
from gridlight.farm import merge as merge_command
from gridlight.farm.job import Job
from gridlight.farm.shards import ShardRunner
from gridlight.farm.votes import merge_votes
from gridlight.formats import probe_file

from .conftest import OPTIONS, parsed


def follow(job, order=None):
    """All shards and the barriers; ``order`` of the shards within an iteration."""
    runner = ShardRunner(job)
    numbers = list(range(len(job.shards)) if order is None else order)
    made = [runner.run(0, number) for number in numbers]
    for group in job.groups:
        merge_votes(job, group)
    return runner, made + [runner.run(1, number) for number in numbers]


def merged(farm_command, job, *options):
    done = farm_command("merge", job.folder, "--no-pictures", *options)
    assert done.returncode in (0, 4), done.stderr
    return done


@pytest.mark.parametrize(
    "count", [pytest.param(1, marks=pytest.mark.any_version), 3, pytest.param(99, marks=pytest.mark.any_version)]
)
def test_any_number_of_shards_gives_the_bytes_of_the_plain_bake(count, planned, farm_command, plain):
    job = Job(planned("--shards", str(count)))
    assert len(job.shards) == min(count, 4)
    follow(job, order=reversed(range(len(job.shards))))
    merged(farm_command, job)
    assert (job.folder / "result" / "probes.exr").read_bytes() == plain()


@pytest.mark.any_version
def test_a_merge_leaves_what_a_bake_leaves(planned, farm_scene, tmp_path):
    """The scene that travels with the job gives the bake's pictures; the report tells the shards' seconds."""
    job = Job(planned())
    follow(job)
    merge_command.run(parsed(merge_command, job.folder), Reporter(quiet=True), lambda: False)
    args = parsed(bake_command, farm_scene, "-o", tmp_path / "bake", *OPTIONS)
    bake_command.run(args, Reporter(quiet=True), lambda: False)
    names = ["preview.png", "preview_probes.png", "probes.exr", "report.html"]
    assert sorted(os.listdir(job.folder / "result")) == sorted(os.listdir(tmp_path / "bake")) == names
    for name in names[:3]:
        assert (job.folder / "result" / name).read_bytes() == (tmp_path / "bake" / name).read_bytes(), name
    seconds = {phase: 0.0 for phase in ("capture", "light")}
    for event in job.events():
        seconds[("capture", "light")[event["iteration"]]] += event["seconds"]
    told = (job.folder / "result" / "report.html").read_text(encoding="utf-8")
    for phase, value in seconds.items():
        assert f"&quot;{phase}&quot;: {round(value, 6)}" in told


@pytest.mark.any_version
def test_running_twice_changes_nothing(planned, farm_command):
    job = Job(planned("--shards", "2"))
    runner, made = follow(job)
    assert all(entry["made"] for entry in made)
    files = list(job.folder.rglob("*.gridlight"))
    times, contents = [path.stat().st_mtime_ns for path in files], [path.read_bytes() for path in files]
    assert not any(runner.run(iteration, number)["made"] for iteration in (0, 1) for number in (0, 1))
    assert [path.stat().st_mtime_ns for path in files] == times
    planned("--shards", "2")  # the same plan again
    assert Job(job.folder).key == job.key
    assert list(job.folder.rglob("*.gridlight")) == files and [path.read_bytes() for path in files] == contents
    with pytest.raises(InputError, match="another bake"):
        planned("--shards", "2", "--seed", "7")
    assert Job(job.folder).key == job.key


@pytest.mark.any_version
def test_surfaces_stay_between_iterations_and_are_made_again_elsewhere(planned, farm_command, plain):
    job = Job(planned())
    runner, made = follow(job)
    relocated = made[4]["captured"] + made[5]["captured"] + made[6]["captured"] + made[7]["captured"]
    assert [entry["captured"] for entry in made[:4]] == [8, 8, 8, 8] and relocated < 8
    for path in (job.folder / "light").iterdir():
        path.unlink()
    elsewhere = ShardRunner(job)
    assert [elsewhere.run(1, number)["captured"] >= 8 for number in range(4)] == [True] * 4
    merged(farm_command, job)
    assert (job.folder / "result" / "probes.exr").read_bytes() == plain()


@pytest.mark.any_version
def test_the_barrier_is_respected(planned):
    job = Job(planned())
    runner = ShardRunner(job)
    with pytest.raises(InputError, match="--iteration 0' first"):
        runner.run(1, 0)
    runner.run(0, 0)
    with pytest.raises(InputError, match="3 votes are missing, the first of shard 1"):
        merge_votes(job, (0, 0))


def damage(path, how):
    if how == "cut off":
        os.truncate(path, path.stat().st_size - 5)
    elif how == "flipped":
        content = bytearray(path.read_bytes())
        content[-3] ^= 1
        path.write_bytes(content)
    else:
        path.write_bytes(b"")


@pytest.mark.any_version
@pytest.mark.parametrize("how", ["cut off", "flipped", "emptied"])
def test_damaged_outputs_are_found_and_made_again(how, planned, farm_command, plain):
    job = Job(planned("--shards", "2"))
    runner, _ = follow(job)
    damage(job.output(1, job.shards[1]), how)
    assert job.output(1, job.shards[1]) is None
    assert [event["event"] for event in job.events()].count("damaged") == 1
    assert not runner.run(1, 0)["made"] and runner.run(1, 1)["made"]
    merged(farm_command, job)
    assert (job.folder / "result" / "probes.exr").read_bytes() == plain()


@pytest.mark.any_version
def test_light_by_an_older_verdict_does_not_count(planned):
    """What was lit before the votes changed is as good as not there."""
    job = Job(planned("--shards", "2"))
    runner, _ = follow(job)
    verdict = job.verdict((0, 0))
    header, arrays = container.arrays(verdict)
    assert job.voted((0, 0)) == {0, 1}
    job.write_verdict((0, 0), {**header, "voted": [0, 1]}, {**arrays, "lit": arrays["lit"] + 1})
    assert not verdict.exists() and job.output(1, job.shards[0]) is None
    assert runner.run(1, 0)["made"]


@pytest.mark.any_version
def test_missing_shards_are_refused_or_marked_invalid(planned, farm_command, plain, tmp_path):
    job = Job(planned())
    follow(job)
    job.output(1, job.shards[2]).unlink()
    done = farm_command("merge", job.folder, "--quiet")
    assert done.returncode == 2 and "shard 2 (frame 1, volume 'volume', block 2)" in done.stderr
    assert len(done.stderr.splitlines()) == 1 and not (job.folder / "result").exists()
    done = merged(farm_command, job, "--without", "2", "--quiet")
    assert "shard 2" in done.stderr and "marked invalid" in done.stderr
    field = probe_file.read(job.folder / "result" / "probes.exr")
    (tmp_path / "whole.exr").write_bytes(plain())
    whole = probe_file.read(tmp_path / "whole.exr")
    lost = field.state != whole.state
    assert lost.sum() == 8 and (field.state[lost] == INVALID).all() and invalid_counts([field]) == {"not_baked": 8}
    np.testing.assert_array_equal(field.coefficients[~lost], whole.coefficients[~lost])
    assert (field.coefficients[lost, 0] > 0).all()  # dilated from its neighbours
    assert any("shard 2" in warning for warning in field.metadata["warnings"])


def test_frames_share_surfaces_while_only_lamps_move(planned, farm_command, plain):
    job = Job(planned("--frames", "1-2", "--shards", "1"))
    scenes = [frame["scene"] for frame in job.plan["frames"]]
    assert scenes[0]["vertices"] == scenes[1]["vertices"] and scenes[0]["lights"] != scenes[1]["lights"]
    runner = ShardRunner(job)
    captured = []
    for number, group in enumerate(job.groups):
        captured.append(runner.run(0, number)["captured"])
        merge_votes(job, group)
        runner.run(1, number)
    assert captured[0] == 32 and captured[1] < 8  # those that had been moved, at home again
    merged(farm_command, job)
    for frame in (1, 2):
        assert (job.folder / "result" / f"frame_{frame:04d}" / "probes.exr").read_bytes() == plain(frame)


@pytest.mark.any_version
def test_other_devices_are_refused(planned, monkeypatch):
    from gridlight.farm import shards

    monkeypatch.setattr(shards, "device_description", lambda: "another | one")
    with pytest.raises(InputError, match="another | one"):
        ShardRunner(Job(planned()))
