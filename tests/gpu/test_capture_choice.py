# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way of capture ``auto`` takes: measured once on the device, kept, the same in every run."""

import json
import time

import numpy as np
import pytest
from gridlight.bake import capture_choice
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.gpu_shaders import capture_trial
from gridlight.gpu_shaders.backend import GpuBackend
from gridlight.gpu_shaders.textures import wait_for_gpu
from small_scenes import snapshot_of

pytestmark = pytest.mark.usefixtures("gpu_context")


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("GRIDLIGHT_CACHE", str(tmp_path / "cache"))
    capture_choice.device_cost.cache_clear()
    yield tmp_path / "cache"
    capture_choice.device_cost.cache_clear()


def test_the_device_is_measured_once_and_the_choice_stays(cache, monkeypatch):
    first = capture_choice.choose_capture(BakeSettings(), 5000, 300)
    kept = json.loads(next(cache.iterdir()).read_text(encoding="utf-8"))
    assert kept["values"]["raster_many"] > 0 and "Blender" in kept["key"]
    capture_choice.device_cost.cache_clear()  # as in the next process
    monkeypatch.setattr(capture_choice, "time_captures", lambda: pytest.fail("measured again"))
    assert capture_choice.choose_capture(BakeSettings(), 5000, 300) == first


def test_what_is_asked_for_is_not_measured(cache, monkeypatch):
    monkeypatch.setattr(capture_choice, "time_captures", lambda: pytest.fail("measured"))
    for method in ("raster", "trace"):
        assert capture_choice.choose_capture(BakeSettings(capture=method), 10, 10)[0] == method
    assert not cache.exists()


def test_millions_of_triangles_are_traced_and_the_reason_names_both_costs(cache):
    method, reason = capture_choice.choose_capture(BakeSettings(), 4_000_000, 300)
    assert method == "trace"
    assert "rasterising" in reason and "rays" in reason and reason.count(" ms") == 2


def test_the_trial_is_short_once_its_shaders_are_compiled():
    capture_trial.time_captures()
    start = time.process_time()
    capture_trial.time_captures()
    assert time.process_time() - start < 0.5


def test_predictions_are_of_the_right_size():
    """Another scene, other faces, other numbers of probes: within a factor of five, on a machine that others use."""
    cost = capture_choice.CaptureCost.fitted(capture_choice.Timings(**capture_trial.time_captures()))
    random = np.random.default_rng(3)
    corners = random.uniform(-2, 2, (1000, 1, 3)) + random.normal(0, 0.1, (1000, 3, 3))
    grid = Grid.from_bounds((-1.5,) * 3, (1.5,) * 3, (4, 4, 4))
    backend = GpuBackend(snapshot_of(corners), grid, BakeSettings(face=24))
    backend.set_probes(np.arange(64), grid.positions())
    for method, predicted in (("raster", cost.raster(64, 1000, 24)), ("trace", cost.trace(64, 1000, 24))):
        seconds = []
        for _ in range(4):
            start = time.perf_counter()
            backend.find_hits(0, 64, method)
            wait_for_gpu()
            seconds.append(time.perf_counter() - start)
        assert 0.2 < predicted / min(seconds) < 5, (method, predicted, seconds)
