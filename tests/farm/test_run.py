# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm run`` on real Dask workers that are killed, hang, or run into damaged files: the bytes of the plain
bake come out, and the log proves that something was tried again.

Sabotage comes from outside: workers start their Blender by a script that patches one function of the standard library
before it hands over. Nothing in the program knows of it.
"""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from gridlight.core.conventions import INVALID
from gridlight.farm.job import Job
from gridlight.formats import probe_file

from .conftest import FARM

pytestmark = pytest.mark.nightly

# ``once(name)`` is true for one process of the whole run; ``die`` ends this Blender and its worker as kill -9 does.
SABOTAGE = """
import os, runpy, signal, sys, threading, time

def once(name):
    try:
        os.close(os.open(os.path.join({marks!r}, name), os.O_CREAT | os.O_EXCL))
        return True
    except FileExistsError:
        return False

def die(worker_too=True):
    if worker_too:
        os.kill(os.getppid(), signal.SIGKILL)
    os.kill(os.getpid(), signal.SIGKILL)

{body}
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
"""

BETWEEN_FILE_AND_NAME = """
rename = os.replace
def replace(source, target):
    if os.sep + "light" + os.sep in str(target) and once("rename"):
        assert os.path.getsize(source) > 0
        die()
    rename(source, target)
os.replace = replace
"""
IN_THE_MIDDLE = """
verdicts = os.path.join(sys.argv[3], "verdict")
def watch():
    while not (os.path.isdir(verdicts) and any(name.endswith(".gridlight") for name in os.listdir(verdicts))):
        time.sleep(0.01)
    time.sleep(0.1)
    if once("middle"):
        die()
threading.Thread(target=watch, daemon=True).start()
"""
HANGS_ONCE = """
synchronise = os.fsync
def fsync(handle):
    if "light" in os.readlink(f"/proc/self/fd/{handle}") and once("hang"):
        time.sleep(1000)
    synchronise(handle)
os.fsync = fsync
"""
HOLDS_SHARD_2 = """
synchronise = os.fsync
def fsync(handle):
    if "/light/.00002" in os.readlink(f"/proc/self/fd/{handle}") and once("held"):
        time.sleep(1000)
    synchronise(handle)
os.fsync = fsync
"""
DIES_WITH_SHARD_2 = """
synchronise = os.fsync
def fsync(handle):
    if "/votes/.00002" in os.readlink(f"/proc/self/fd/{handle}"):
        die(worker_too=False)
    synchronise(handle)
os.fsync = fsync
"""


@pytest.fixture
def launch(tmp_path):
    """Starts a command whose workers' Blenders are sabotaged by ``body`` if there is one. What runs ends with the
    test."""
    started = []

    def begin(command, body="", **environment):
        (tmp_path / "marks").mkdir(exist_ok=True)
        script = tmp_path / f"sabotage{len(started)}.py"
        script.write_text(SABOTAGE.format(marks=str(tmp_path / "marks"), body=body))
        python = tmp_path / f"python{len(started)}"
        python.write_text(f'#!/bin/sh\nshift\nexec "{sys.executable}" -I "{script}" "$@"\n')
        python.chmod(0o755)
        chosen = {"GRIDLIGHT_BLENDER_PYTHON": str(python if body else sys.executable)}
        process = subprocess.Popen(
            [*map(str, command)],
            env={**os.environ, **chosen, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            process_group=0,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            process.kill()


@pytest.fixture
def start(dask_python, launch):
    """Starts ``farm run`` on a job with a number of workers, or with those of the scheduler at an address."""

    def begin(job, workers, body="", *options):
        where = ("--scheduler", workers) if isinstance(workers, str) else ("--workers", workers)
        return launch([dask_python, "-I", FARM, "run", job, *where, "--no-pictures", *options], body)

    return begin


@pytest.fixture
def cluster(dask_python, launch, tmp_path):
    """Starts a Dask scheduler and workers, each a process of its own; returns all of them and the address."""

    def begin(workers, body=""):
        told = tmp_path / f"scheduler{len(list(tmp_path.glob('scheduler*')))}.json"
        options = ("--host", "127.0.0.1", "--port", 0, "--no-dashboard", "--scheduler-file", told)
        scheduler = launch([dask_python, "-I", "-m", "dask", "scheduler", *options])
        wait_for(lambda: told.exists() and told.read_text().endswith("}"))
        address = json.loads(told.read_text())["address"]
        serving = [launch([dask_python, "-I", FARM, "worker", address], body) for _ in range(workers)]
        return scheduler, serving, address

    return begin


def ended(process, status=0):
    output, errors = process.communicate(timeout=300)
    assert process.returncode == status, errors
    return output, errors


def kinds(job):
    return [event["event"] for event in Job(job).events()]


def result(job):
    return (job / "result" / "probes.exr").read_bytes()


def wait_for(condition, seconds=120):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


@pytest.mark.parametrize("workers,shards", [(1, 1), (1, 4), (2, 2), (2, 4), (4, 4)])
def test_any_number_of_workers_gives_the_bytes_of_the_plain_bake(workers, shards, planned, start, plain):
    job = planned("--shards", str(shards))
    output, errors = ended(start(job, workers))
    assert json.loads(output.splitlines()[-1])["poison"] == []
    assert result(job) == plain() and "failed" not in kinds(job)


@pytest.mark.parametrize("body", [BETWEEN_FILE_AND_NAME, IN_THE_MIDDLE], ids=["before the rename", "in the middle"])
def test_a_killed_worker_is_replaced_and_its_shard_made_again(body, planned, start, plain):
    job = planned()
    _, errors = ended(start(job, 2, body))
    failed = [event for event in Job(job).events() if event["event"] == "failed"]
    assert len(failed) == 1 and failed[0]["iteration"] == 1 and failed[0]["attempt"] == 1, failed
    assert "SIGKILL" in errors and "another one is started" in errors
    made = [e["shard"] for e in Job(job).events() if e["event"] == "done" and e["iteration"] == 1]
    assert sorted(made) == [0, 1, 2, 3]
    assert result(job) == plain()
    if body == BETWEEN_FILE_AND_NAME:
        assert len(list((job / "light").glob(".*.part"))) == 1  # what the killed one left is never taken for a result


def held(job, tmp_path):
    """Waits until some process has made shard 2 and holds it back before it takes its name: a try that is lost when
    that process ends."""
    wait_for((tmp_path / "marks" / "held").exists)
    assert len(list((job / "light").glob(".00002.*.part"))) == 1 and not list((job / "light").glob("00002-*"))


def assert_shard_2_was_tried_again(job, plain):
    """The try that was lost left its temporary file; the output was made once, after the job was resumed."""
    events = Job(job).events()
    resumed = max(number for number, event in enumerate(events) if event["event"] == "resumed")
    made = [number for number, event in enumerate(events) if event.get("shard") == 2 and event.get("iteration") == 1]
    assert len(made) == 1 and made[0] > resumed and events[made[0]]["event"] == "done"
    assert events[resumed]["there"] >= 5  # four votes and their verdict at least
    assert len(list((job / "light").glob(".00002.*.part"))) == 1
    assert result(job) == plain()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "Ctrl-C"])
def test_a_run_that_ends_early_is_resumed(number, planned, start, plain, tmp_path):
    """The process of ``farm run`` is its workers' scheduler."""
    job = planned()
    process = start(job, 2, HOLDS_SHARD_2)
    held(job, tmp_path)
    process.send_signal(number)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == (-9 if number == signal.SIGKILL else 130)
    if number == signal.SIGINT:
        assert "goes on from here" in errors and "Traceback" not in errors
    wait_for(lambda: not servants(job))  # nobody works on without a scheduler
    ended(start(job, 2))
    assert_shard_2_was_tried_again(job, plain)


def test_workers_of_a_scheduler_that_is_killed_and_started_again(
    planned, start, launch, cluster, dask_python, plain, tmp_path
):
    """Whoever runs the job needs no GPU: the workers have theirs."""
    job = planned()
    scheduler, workers, address = cluster(2, HOLDS_SHARD_2)
    process = start(job, address)
    held(job, tmp_path)
    scheduler.kill()
    _, errors = ended(process, status=2)
    assert "the Dask scheduler has gone" in errors and "goes on from here" in errors and "Traceback" not in errors
    assert "failed" not in kinds(job)  # nobody is blamed
    for worker in workers:
        assert worker.wait(timeout=120) is not None  # they end by themselves
    wait_for(lambda: not servants(job))
    _, _, address = cluster(2)
    command = [dask_python, "-I", FARM, "run", job, "--scheduler", address]
    _, errors = ended(launch(command, LIBGL_DRIVERS_PATH="/nonexistent"))
    assert "no pictures are drawn here" in errors
    assert sorted(os.listdir(job / "result")) == ["probes.exr", "report.html"]
    assert_shard_2_was_tried_again(job, plain)


def servants(job):
    """Processes that serve ``job``."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open(f"/proc/{entry}/cmdline", "rb") as file:
                    words = file.read().split(b"\0")
            except OSError:
                continue
            if b"serve" in words and os.fsencode(job) in words:
                found.append(int(entry))
    return found


def test_damaged_outputs_are_made_again(planned, start, plain):
    job = planned()
    ended(start(job, 1))
    first, second = sorted((job / "light").glob("*.gridlight"))[:2]
    os.truncate(first, 100)
    content = bytearray(second.read_bytes())
    content[len(content) // 2] ^= 4
    second.write_bytes(content)
    (job / "result" / "probes.exr").unlink()
    before = kinds(job).count("done")
    ended(start(job, 1))
    assert kinds(job).count("damaged") == 2 and kinds(job).count("done") == before + 2
    assert result(job) == plain()


def test_a_shard_that_hangs_is_ended_and_tried_again(planned, start, plain):
    job = planned()
    _, errors = ended(start(job, 1, HANGS_ONCE, "--timeout", "15"))
    assert "took longer than 15 s" in errors and kinds(job).count("failed") == 1
    assert result(job) == plain()


def test_a_poison_shard_is_named_and_the_rest_is_merged(planned, start, plain, tmp_path):
    job = planned()
    output, errors = ended(start(job, 2, DIES_WITH_SHARD_2), status=4)
    assert "shard 2 (frame 1, volume 'volume', block 2) failed 3 times" in errors
    assert kinds(job).count("failed") == 3 and kinds(job).count("poison") == 1
    assert json.loads(output.splitlines()[-1])["poison"] == [2]
    field = probe_file.read(job / "result" / "probes.exr")
    (tmp_path / "whole.exr").write_bytes(plain())
    assert ((field.state == INVALID) & (probe_file.read(tmp_path / "whole.exr").state != INVALID)).sum() == 8
    ended(start(job, 2))  # what was poison is tried again, and the verdict with it
    assert result(job) == plain()
