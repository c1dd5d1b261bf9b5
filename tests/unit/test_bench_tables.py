# SPDX-License-Identifier: GPL-3.0-or-later
"""What benches make of rows: exponents of growth, the fastest setting at an error, aligned tables, whole pictures."""

from xml.etree import ElementTree

import pytest
from gridlight.cli import bench_chart, bench_pareto, bench_scaling, bench_table


def row(size, seconds, **phases):
    return {"size": size, "seconds": seconds, "phases": phases}


def test_exponents_of_powers_are_found():
    rows = [row(n, 1e-3 * n**1.5, rays=1e-6 * n**2, field=0.5) for n in (10, 100, 1000, 10_000)]
    found = bench_scaling.exponents(rows)
    assert found == pytest.approx({"rays": 2.0, "field": 0.0, "whole": 1.5})


def test_the_crossover_lies_where_both_captures_take_the_same_time():
    def rows(seconds_of):
        return [{"size": n, "triangles": n, "phases": {"capture": seconds_of(n)}} for n in (1000, 10_000, 100_000)]

    rasterised, traced = rows(lambda n: 1e-6 * n), rows(lambda n: 2e-2)
    assert bench_scaling.crossover(rasterised, traced) == pytest.approx(20_000)
    assert bench_scaling.crossover(traced, rasterised) is None
    assert bench_scaling.crossover(rasterised[:1], traced) is None


def test_growth_is_told_from_ten_thousand_triangles_on():
    def hall(size, capture, light):
        phases = {"read": 1.0, "capture": capture, "light": light}
        return {"size": size, "triangles": size, "probes": 10, "seconds": sum(phases.values()), "phases": phases}

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
