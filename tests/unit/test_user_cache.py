# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept between runs: found again, measured anew where it is damaged, and never in the way."""

import json
import threading

import pytest
from gridlight.core import user_cache


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "deep" / "cache"
    monkeypatch.setenv("GRIDLIGHT_CACHE", str(folder))
    return folder


def number(values):
    return float(values["number"])


def never():
    raise AssertionError("measured although it was kept")


def test_what_was_measured_is_found_again(cache):
    assert user_cache.kept("speed", "device", number, lambda: {"number": 3}) == (3.0, True)
    assert user_cache.kept("speed", "device", number, never) == (3.0, True)
    assert [path.suffix for path in cache.iterdir()] == [".json"]


def test_other_keys_have_other_values():
    user_cache.kept("speed", "device", number, lambda: {"number": 3})
    assert user_cache.kept("speed", "other device", number, lambda: {"number": 4}) == (4.0, True)


@pytest.mark.parametrize(
    "damage",
    [
        "",
        "{",
        "[]",
        "null",
        '{"key": "device"}',
        '{"key": "device", "values": {}}',
        '{"key": 1, "values": {"number": 1}}',
    ],
)
def test_damaged_files_are_measured_anew(cache, damage):
    user_cache.kept("speed", "device", number, lambda: {"number": 3})
    file = next(cache.iterdir())
    file.write_text(damage, encoding="utf-8")
    assert user_cache.kept("speed", "device", number, lambda: {"number": 5}) == (5.0, True)
    assert json.loads(file.read_text(encoding="utf-8"))["values"] == {"number": 5}


def test_without_a_folder_it_is_measured_every_time(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("GRIDLIGHT_CACHE", str(tmp_path / "file" / "below"))
    assert user_cache.kept("speed", "device", number, lambda: {"number": 3}) == (3.0, False)
    assert user_cache.kept("speed", "device", number, lambda: {"number": 4}) == (4.0, False)


def test_a_user_without_a_home_keeps_nothing(monkeypatch):
    def homeless(_path):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("GRIDLIGHT_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(user_cache.Path, "expanduser", homeless)
    assert user_cache.kept("speed", "device", number, lambda: {"number": 3}) == (3.0, False)


def test_all_who_measure_at_once_go_on_with_one_value(cache):
    results, together = [], threading.Barrier(8)

    def work(index):
        def measure():
            together.wait()  # everybody has found nothing before anybody writes
            return {"number": index}

        results.append(user_cache.kept("speed", "device", number, measure))

    threads = [threading.Thread(target=work, args=(index,)) for index in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(results)) == 1 and results[0][1]
    assert len(list(cache.iterdir())) == 1, "temporary files are gone"


def test_the_folder_follows_the_systems_rule(monkeypatch, tmp_path):
    monkeypatch.delenv("GRIDLIGHT_CACHE")
    monkeypatch.setattr(user_cache.sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache.folder() == tmp_path / "gridlight"
