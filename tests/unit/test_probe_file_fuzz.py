# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe file's reader against files that are cut, flipped, or lie about their size: an error, never a crash, a hang
or more than a gigabyte."""

import json
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import probe_file

pytestmark = pytest.mark.any_version

MUTATOR = Path(__file__).with_name("mutate_probe_files.py")


@pytest.fixture
def good_file(tmp_path):
    field = Field.empty(Grid.from_bounds((0, 0, 0), (1, 2, 3), (3, 4, 2)), 3)
    field.coefficients[:] = np.random.default_rng(0).normal(size=field.coefficients.shape)
    field.depth[:] = np.random.default_rng(1).random(field.depth.shape)
    path = tmp_path / "good.exr"
    probe_file.write(path, field)
    return path


def read_mutations(path, seed, count):
    command = [sys.executable, "-I", MUTATOR, path, str(seed), str(count)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, (done.returncode, done.stdout[-300:], done.stderr[-2000:])
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["errors"] + found["equal"] + found["unequal"] == count
    assert found["unequal"] == 0 and found["errors"] > 0.9 * count
    assert found["slowest_seconds"] < 5 and found["most_memory_mib"] < 1024
    return found


def test_a_few_hundred_mutations(good_file):
    read_mutations(good_file, 1, 600)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(2, 12))
def test_a_hundred_thousand_mutations(good_file, seed):
    read_mutations(good_file, seed, 10_000)


@pytest.mark.parametrize("length", [0, 1, 3, 4, 5, 8, 20, 100, 1000, 3000])
def test_short_files(good_file, length):
    good_file.write_bytes(good_file.read_bytes()[:length])
    with pytest.raises(InputError, match="good.exr"):
        probe_file.read(good_file)


def lying(path, resolution, window):
    """The file with its JSON and its window saying other sizes than its pixels have; offsets stay where they were."""
    data = path.read_bytes()
    at = data.index(b"gridlight\0string\0") + len(b"gridlight\0string\0")
    (length,) = struct.unpack_from("<i", data, at)
    document = json.loads(data[at + 4 : at + 4 + length])
    document["resolution"] = resolution
    del document["digest"]
    text = json.dumps(document).encode()
    data = data[:at] + struct.pack("<i", len(text)) + text + data[at + 4 + length :]
    for name in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = data.index(name) + len(name) + 4
        data = data[:at] + struct.pack("<4i", 0, 0, window[0] - 1, window[1] - 1) + data[at + 16 :]
    path.write_bytes(data)


@pytest.mark.parametrize("resolution", [(110, 110, 110), (256, 256, 256), (256, 1, 1), (1, 256, 256), (30, 30, 30)])
def test_sizes_that_the_file_cannot_hold(good_file, resolution):
    """Consistent in all that the header says, so only the length of the file gives it away."""
    nx, ny, nz = resolution
    lying(good_file, list(resolution), (nx, ny * nz))
    program = (
        "import resource, runpy, sys\n"
        "resource.setrlimit(resource.RLIMIT_AS, (1 << 30, 1 << 30))\n"
        f"sys.argv = ['gridlight', 'info', {str(good_file)!r}]\n"
        f"runpy.run_path({str(MUTATOR.parents[2] / 'cli' / '__main__.py')!r}, run_name='__main__')\n"
    )
    environment = {"OPENBLAS_NUM_THREADS": "1"}  # whose threads' stacks would count against the limit
    command = [sys.executable, "-I", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False, env=environment)
    assert done.returncode == 2 and "good.exr" in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr


@pytest.mark.parametrize(
    "resolution",
    [[0, 4, 2], [-3, 4, 2], [3, 4, 1 << 40], [3.0, 4, 2], ["3", 4, 2], [3, 4], [3, 4, 2, 1], None, [True, 24, 1]],
)
def test_resolutions_that_make_no_sense(good_file, resolution):
    lying(good_file, resolution, (3, 8))
    with pytest.raises(InputError, match="good.exr"):
        probe_file.read(good_file)


def test_deeply_nested_json_is_an_error(good_file):
    data = good_file.read_bytes()
    at = data.index(b"gridlight\0string\0") + len(b"gridlight\0string\0")
    (length,) = struct.unpack_from("<i", data, at)
    text = b"[" * 200_000
    good_file.write_bytes(data[:at] + struct.pack("<i", len(text)) + text + data[at + 4 + length :])
    with pytest.raises(InputError, match="good.exr"):
        probe_file.read(good_file)


def test_a_large_file_is_in_memory_once(tmp_path):
    """Reading 128 MiB of probes takes little more than that, not several times as much."""
    field = Field.empty(Grid.from_bounds((0, 0, 0), (1, 1, 1), (59, 60, 60)), 3)
    path = tmp_path / "large.exr"
    probe_file.write(path, field)
    program = (
        "import importlib.util, resource, sys\n"
        f"spec = importlib.util.spec_from_file_location('mutator', {str(MUTATOR)!r})\n"
        "mutator = importlib.util.module_from_spec(spec); spec.loader.exec_module(mutator); mutator.load_package()\n"
        "from gridlight.formats import probe_file\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        f"field = probe_file.read({str(path)!r})\n"
        "field.depth += 1\n"
        "print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) >> 10)\n"
    )
    command = [sys.executable, "-I", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert int(done.stdout) < 1.7 * 128, (done.stdout, done.stderr)
