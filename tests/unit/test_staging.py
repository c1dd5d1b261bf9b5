# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a run appear whole and together, or not at all."""

import os

import pytest
from gridlight.core.errors import Cancelled, InputError
from gridlight.formats.staging import StagedFolder, remove_leftovers


def test_files_appear_at_the_end(tmp_path):
    with StagedFolder(tmp_path / "a" / "b") as folder:
        for name in ("probes.exr", "report.html"):
            folder.path(name).write_text(name)
            assert folder.staged(name).suffix == "." + name.split(".")[1]
        assert not (tmp_path / "a" / "b" / "probes.exr").exists()
    assert sorted(path.name for path in (tmp_path / "a" / "b").iterdir()) == ["probes.exr", "report.html"]


@pytest.mark.parametrize("error", [Cancelled("stop"), KeyboardInterrupt(), ValueError("defect")])
def test_an_exception_leaves_nothing_and_passes(tmp_path, error):
    with pytest.raises(type(error)), StagedFolder(tmp_path / "a" / "b") as folder:
        folder.path("probes.exr").write_text("half")
        raise error
    assert not list(tmp_path.iterdir())


def test_older_results_and_other_files_stay(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "probes.exr").write_text("old")
    with pytest.raises(InputError, match="No space left"), StagedFolder(tmp_path / "out") as folder:
        folder.path("probes.exr").write_text("new")
        raise OSError(28, "No space left on device")
    assert [path.read_text() for path in (tmp_path / "out").iterdir()] == ["old"]


@pytest.mark.parametrize("place", ["{file}/out", "{file}", "/proc/out", "/dev/null/out", "x" * 300])
def test_places_that_cannot_be_written(tmp_path, place):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match="cannot write"), StagedFolder(place.format(file=file)):
        pass
    assert list(tmp_path.iterdir()) == [file]


def test_a_name_taken_by_a_folder(tmp_path):
    (tmp_path / "probes.exr").mkdir()
    with pytest.raises(InputError, match="cannot write .*probes.exr"), StagedFolder(tmp_path) as folder:
        folder.path("probes.exr").write_text("new")
    assert [path.name for path in tmp_path.iterdir()] == ["probes.exr"]


def test_leftovers_of_a_killed_process_are_found(tmp_path):
    folder = StagedFolder(tmp_path)
    folder.path("probes.exr").write_text("half")
    (tmp_path / "mine.part.exr").write_text("keep")
    remove_leftovers(tmp_path, os.getpid(), [])
    assert [path.name for path in tmp_path.iterdir()] == ["mine.part.exr"]
