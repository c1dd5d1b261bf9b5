# SPDX-License-Identifier: GPL-3.0-or-later
"""What benches make of rows: exponents of growth, the fastest setting at an error, aligned tables, whole pictures."""

from xml.etree import ElementTree

import pytest
from gridlight.cli import bench_chart, bench_frame, bench_pareto, bench_scaling, bench_table

pytestmark = pytest.mark.any_version


def row(size, seconds, **phases):
    return {"size": size, "seconds": seconds, "phases": phases}


def test_exponents_of_powers_are_found():
    rows = [row(n, 1e-3 * n**1.5, rays=1e-6 * n**2, field=0.5) for n in (10, 100, 1000, 10_000)]
    found = bench_scaling.exponents(rows)
    assert found == pytest.approx({"rays": 2.0, "field": 0.0, "whole": 1.5})


def test_the_crossover_lies_where_both_captures_take_the_same_time():
    def rows(seconds_of):
        return [{"size": n, "triangles": n, "capture_again": seconds_of(n)} for n in (1000, 10_000, 100_000)]

    rasterised, traced = rows(lambda n: 1e-6 * n), rows(lambda n: 2e-2)
    assert bench_scaling.crossover(rasterised, traced) == pytest.approx(20_000)
    assert bench_scaling.crossover(traced, rasterised) is None
    assert bench_scaling.crossover(rasterised[:1], traced) is None


def test_growth_is_told_from_ten_thousand_triangles_on():
    def hall(size, capture, light):
        phases = {"read": 1.0, "capture": 100.0 * size, "light of patches": light}
        return {"size": size, "triangles": size, "probes": 10, "capture_again": capture, "phases": phases}

    rows = [hall(1000, 1.0, 1.0), hall(10_000, 2.0, 2.0), hall(1_000_000, 3.0, 4.0)]
    assert bench_scaling.growth(rows) == pytest.approx({"to": 1_000_000, "capture": 1.5, "bake": 7 / 4})
    assert bench_scaling.growth(rows[:2]) is None


def test_two_sizes_tell_no_exponent():
    assert bench_scaling.exponents([row(1, 1.0), row(2, 2.0)]) == {}


def test_the_fastest_is_chosen_among_those_that_are_exact_enough():
    def peer(name, seconds, error):
        return {"peer": name, "setting": f"{seconds}", "seconds": seconds, "error": {"relative_rms": error}}

    rows = [
        peer("Gridlight", 1.0, 0.04),
        peer("Gridlight", 2.0, 0.019),
        peer("Gridlight", 3.0, 0.001),
        peer("Cycles panoramas", 9.0, 0.021),
        peer("Cycles panoramas", 20.0, 0.01),
        {"peer": "EEVEE volume", "setting": "", "seconds": 0.1, "error": None},
    ]
    found = bench_pareto.best(rows, {"noise": 0.0})
    assert [side["seconds"] for side in found["2"]] == [2.0, 20.0]
    assert [side["seconds"] for side in found["3"]] == [2.0, 9.0]
    assert [side["seconds"] for side in found["5"]] == [1.0, 9.0]


def test_columns_stand_below_each_other_and_reasons_stick_out():
    lines = bench_table.columns([["name", "s"], ["a", "1.25"], ["longer", "10"], ["b"]], left=1)
    assert lines == ["name       s", "a       1.25", "longer    10", "b"]
    assert bench_table.columns([["x", "y"], ["a very long reason"]])[0] == "x  y"


def test_pictures_leave_out_what_has_no_logarithm_and_say_where_nothing_is():
    chart, empty = bench_chart.Chart("a < b", "x", "y"), bench_chart.Chart("none", "x", "y")
    chart.line("seconds", [1, 10, 100], [0.0, 2.0, 3.0])
    chart.points("others", [5], [5], ["tip & more"])
    summary = {"device": "GPU", "machine": {"cores": 2}, "blender": "5.2"}
    picture = ElementTree.fromstring(bench_chart.page("title", summary, [chart, empty]))
    tags = [element.tag.rpartition("}")[2] for element in picture.iter()]
    assert tags.count("circle") == 3 and tags.count("polyline") == 1
    texts = [element.text for element in picture.iter() if element.text]
    assert "a < b" in texts and "nothing was measured" in texts and "others: tip & more" in texts


MACHINE = {"cores": 2, "processor": "CPU", "system": "Linux", "load_before": 0.0}
HEAD = {"device": "GPU", "blender": "5.2", "machine": MACHINE, "command": "bench", "version": "1"}


def drawn(benchmark, summary):
    """(table as text, number of points in the picture)."""
    picture = ElementTree.fromstring(benchmark.plot(summary))
    points = [element for element in picture.iter() if element.tag.endswith("circle")]
    return "\n".join(benchmark.table(summary)), len(points)


def test_frame_tells_bandwidth_only_where_it_is_not_lost_in_waiting():
    def cost(dispatches, seconds, moved):
        return {"dispatches": dispatches, "seconds": seconds, "bytes": moved, "groups": 10.0}

    summary = {
        **HEAD,
        "scene": {"name": "gallery", "triangles": 10, "active": 5, "lights": 1},
        "picture": [1920, 1080],
        "cold_bake_seconds": 1.0,
        "cold_picture_seconds": None,
        "rows": [
            {"run": "slice", "median": 2e-3, "percentile_99": 3e-3, "longest": 4e-3, "count": 7},
            {
                "run": "relight, in one go",
                "median": 5e-3,
                "percentile_99": 6e-3,
                "longest": 7e-3,
                "count": 3,
                "phases": {"field": 1e-3},
                "watched_seconds": 5e-3,
                "patches": 99,
                "iterations": 8,
            },
        ],
        "longest_steps": {"capture": 2.5e-3},
        "limits": {"copy_bytes_per_second": 1e12, "operations_per_second": 5e13, "wait_seconds": 1e-5},
        "profiled_seconds": 6e-3,
        # 1 ms for 0.5 GB after two waits of 10 µs: half of the bandwidth
        "shaders": {"long_comp": cost(2, 1e-3 + 2e-5, 5e8), "short_comp": cost(1, 1.1e-5, 1e6)},
        "functions": [{"function": "f", "calls": 2.0, "own_seconds": 1e-3, "whole_seconds": 2e-3}],
        "problem": "killed",
    }
    text, points = drawn(bench_frame, summary)
    assert points == 2
    long, short = (next(line.split() for line in text.splitlines() if name in line) for name in ("long_", "short_"))
    assert long[-3:] == ["500", "50.0%", "100"] and short[-3:] == ["–", "–", "–"]
    assert "outside of all phases  4.00" in text and "ended early: killed" in text


def test_pareto_tells_of_scenes_and_settings_that_failed():
    def peer(name, setting, seconds, error, problem=""):
        figures = {"relative_rms": error, "bias": 0.0} if error else None
        row = {"peer": name, "setting": setting, "run": "warm", "seconds": seconds, "error": figures, "phases": {}}
        return {**row, "measured": 8, "problem": problem}

    rows = [
        peer("Gridlight", "default", 1.0, 0.01),
        peer("Gridlight", "gather 2", None, None, "its process ended with SIGSEGV"),
        peer("Cycles panoramas", "32×16, 4 samples", 5.0, 0.02),
    ]
    reference = {"nodes": 3, "seeds": 2, "samples": 8, "noise": 0.001, "floor": {"relative_rms": 0.007}, "bands": 3}
    part = {
        "name": "gallery",
        "scene": {"triangles": 10, "locations": 8, "resolution": [2, 2, 2]},
        "reference": reference,
        "rows": rows,
        "left_out": ["bands 4"],
        "best": bench_pareto.best(rows, reference),
        "three": {"revision": "187", "device": "SwiftShader"},
    }
    broken = {"name": "x.blend", "scene": None, "problem": "x.blend: is damaged", "rows": []}
    text, points = drawn(bench_pareto, {**HEAD, "scenes": [part, broken]})
    assert points == 2
    assert (
        "not measured: its process ended with SIGSEGV" in text and "x.blend: not measured: x.blend: is damaged" in text
    )
    assert "at most 2 %" in text and "5 times faster" in text and "bands 4" in text and "r187" in text


def test_scaling_names_what_was_left_out():
    sweep = {"name": "triangles", "parameter": "triangles", "capture": "trace"}
    measured = {
        "run": "triangles",
        "size": 1000,
        "seconds": 3.0,
        "probes": 100,
        "triangles": 1008,
        "face": 16,
        "patches": 5,
        "resident": False,
        "predicted_capture": 0.5,
        "capture_again": 0.4,
        "phases": {"read": 1.0, "capture": 2.0},
    }
    left_out = {"sweep": "triangles", "from": 3000, "expected_seconds": 77.0}
    summary = {
        **HEAD,
        "base": bench_scaling.BASE,
        "cold": {
            "context_seconds": 0.1,
            "trial_seconds": 0.2,
            "variants": [{"capture": "trace", "face": 16, "seconds": 4.0}],
        },
        "sweeps": [{**sweep, "rows": [measured], "exponents": {}, "left_out": left_out}],
        "crossover_triangles": None,
        "problem": None,
    }
    text, points = drawn(bench_scaling, summary)
    assert points == 2  # whole and capture
    assert "1008*" in text and "captured again" in text and "30000" in text and "from 3000 on left out" in text
