# SPDX-License-Identifier: GPL-3.0-or-later
"""``bench peers`` end to end with tiny settings: rows, JSON, files, and peers that fail without ending the rest."""

import json
from xml.etree import ElementTree

import pytest
from gridlight.cli import bench_process
from gridlight.tests.command_line import last_json

pytestmark = pytest.mark.any_version

TINY = ("bench", "peers", "--panoramas", 2, "--face", 4, "--tolerance", 0.1, "--quiet")


@pytest.fixture(scope="module")
def bench(run_gridlight, tmp_path_factory):
    """(summary, table, folder) of a bench with errors and without EEVEE."""
    folder = tmp_path_factory.mktemp("bench") / "new"
    done = run_gridlight(*TINY, "--no-eevee", "--error", "--error-nodes", 2, "--error-spp", 2, "-o", folder)
    assert done.returncode == 0, done.stderr
    *table, last = done.stdout.splitlines()
    return json.loads(last), "\n".join(table), folder


def warm_or_more(row, warm):
    return row["seconds"] > 0.5 * warm["seconds"] and row["error"] == warm["error"]


def test_every_peer_has_its_rows_and_its_figures(bench):
    summary, table, _ = bench
    rows = summary["rows"]
    assert [(row["peer"], row["run"]) for row in rows[:2]] == [("Gridlight", "cold"), ("Gridlight", "warm")]
    assert [row["setting"] for row in rows[2:-1]] == ["64×32, 8 samples", "32×16, 8 samples", "128×64, 8 samples"]
    assert (rows[-1]["peer"], rows[-1]["run"]) == ("Gridlight", "first")
    assert warm_or_more(rows[-1], rows[1]) and rows[-1]["seconds"] < rows[0]["seconds"], "its shaders were cached"
    assert summary["scene"]["locations"] == 308 and summary["scene"]["resolution"] == [11, 4, 7]
    warm = rows[1]["seconds"]
    for row in rows:
        assert row["probes_per_second"] == pytest.approx(308 / row["seconds"])
        assert row["ratio_to_warm"] == pytest.approx(row["seconds"] / warm)
        assert 0 < row["error"]["relative_rms"] < 1
        assert row["peer"] in table and row["setting"] in table
    assert {"setup", "read", "cull", "capture", "light"} <= set(rows[0]["phases"])
    assert sum(rows[1]["phases"].values()) == pytest.approx(warm, rel=0.2)
    for key in ("device", "blender", "version", "machine", "command", "warnings"):
        assert key in summary
    assert summary["device"] in table and summary["command"] in table


def test_few_panoramas_are_scaled_to_all_locations_and_marked(bench):
    summary, table, _ = bench
    for row in summary["rows"][2:-1]:
        assert row["measured"] == 2
        first, rest = row["phases"]["first"], row["phases"]["rest"]
        assert row["seconds"] == pytest.approx(first + rest)
        assert rest > 10 * first / 308  # the other 307, not the one that was measured
    assert table.count("2 scaled") == 3


def test_more_texels_of_the_same_renderer_are_more_exact(bench):
    """32×16 panoramas are too coarse for the gallery's lamps: an error that mixes up rows or nodes would not see it."""
    summary, _, _ = bench
    coarse, fine = (
        next(row for row in summary["rows"] if row["setting"].startswith(size)) for size in ("32×16", "128×64")
    )
    assert fine["error"]["relative_rms"] < 0.1
    assert fine["seconds"] > coarse["seconds"]
    assert summary["reference"]["noise"] < 0.1 and summary["reference"]["floor"]["relative_rms"] < 0.05


def test_files_are_whole(bench):
    summary, table, folder = bench
    assert sorted(path.name for path in folder.iterdir()) == ["peers.json", "peers.svg", "peers.txt"]
    assert (folder / "peers.txt").read_text(encoding="utf-8").strip() == table.strip()
    assert json.loads((folder / "peers.json").read_text(encoding="utf-8")) == summary
    picture = ElementTree.parse(folder / "peers.svg").getroot()
    circles = [element for element in picture.iter() if element.tag.endswith("circle")]
    assert len(circles) == len(summary["rows"])


def test_our_own_bake_past_its_limit_ends_the_bench(run_gridlight):
    """Without our own bake there is nothing to compare with: the bench says so instead of printing half a table."""
    done = run_gridlight(*TINY, "--limit", 1)
    assert done.returncode == 2
    assert "not done after 1 s" in done.stderr and "our own bake" in done.stderr
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("peer", "limit_s", "reason"), [("cycles", 0.3, "not done after 0.3 s"), ("nonsense", 60, "ended with status 1")]
)
def test_a_process_that_hangs_or_fails_leaves_a_reason(peer, limit_s, reason):
    request = {"peer": peer, "panorama": [64, 32, 8], "panoramas": None, "nodes": [], "bands": 3}
    reports, problem = bench_process.measure_in_child(request, limit_s, ["--quiet"], in_blender=False, verbose=False)
    assert reports == [] and reason in problem


@pytest.mark.nightly
def test_eevee_bakes_the_same_volume_or_says_why_not(run_gridlight):
    done = run_gridlight(*TINY, "--eevee-samples", 1)
    assert done.returncode == 0, done.stderr
    summary = last_json(done)
    rows = [row for row in summary["rows"] if row["peer"] == "EEVEE volume"]
    if rows[-1]["seconds"] is None:
        assert rows[-1]["problem"] and rows[-1]["problem"] in done.stdout
    else:
        assert [row["run"] for row in rows] == ["cold", "warm"]
        assert rows[0]["seconds"] > rows[1]["seconds"] > 0
    assert all(row["error"] is None for row in summary["rows"]) and summary["reference"] is None


@pytest.mark.parametrize(
    "arguments",
    [
        ("--panoramas", "0"),
        ("--error-nodes", "0"),
        ("--limit", "nan"),
        ("--face", "1"),
        ("--eevee-samples", "-1"),
        ("--budget", "0"),
        ("--scene", "/no/such.blend"),
        ("-o", "/dev/null/x"),
    ],
)
def test_wrong_options_are_refused_before_anything_runs(run_gridlight, arguments):
    done = run_gridlight("bench", "peers", *arguments)
    assert done.returncode == 2
    assert done.stdout == "" and len(done.stderr.splitlines()) == 1


def children(request):
    """What the process that measures ``request`` reports; it must end by itself."""
    reports, problem = bench_process.measure_in_child(request, 300, ["--quiet"], in_blender=False, verbose=False)
    assert problem == ""
    return reports


def test_scaling_reports_sizes_until_the_time_is_up():
    sweeps = [{"name": "triangles", "parameter": "triangles", "capture": "trace", "sizes": [1000, 4000, 1 << 50]}]
    sweeps.append({"name": "lamps", "parameter": "lamps", "capture": "trace", "sizes": [40]})
    base = {"probes": 18, "triangles": 1000, "face": 4, "lamps": 2}
    reports = children({"peer": "scaling", "seconds": 1e5, "base": base, "settings": {}, "sweeps": sweeps})
    rows = [report for report in reports if "run" in report]
    assert [row["lamps"] for row in rows if row["run"] == "lamps"] == [40]
    rows = [row for row in rows if row["run"] == "triangles"]
    assert [row["size"] for row in rows] == [1000, 4000]
    assert [round(row["triangles"], -3) for row in rows] == [1000, 4000]
    for row in rows:
        assert row["capture"] == "trace" and row["probes"] == 18 and row["face"] == 4
        assert {"read", "capture", "finding patches", "light of patches", "field"} <= set(row["phases"])
        assert sum(row["phases"].values()) == pytest.approx(row["seconds"], rel=0.3)
    left_out = next(report["left_out"] for report in reports if "left_out" in report)
    assert left_out["from"] == 1 << 50 and left_out["expected_seconds"] > 1e5
    assert next(report["cold"] for report in reports if "cold" in report)["seconds"] > 0


@pytest.mark.nightly
def test_error_over_time_of_a_room(run_gridlight, tmp_path):
    """All peers that are here; the ones that are not say what is missing."""
    room = ("--scene", "cornell", "--panoramas", 2, "--error-nodes", 4, "--error-spp", 8, "--budget", 400)
    done = run_gridlight("bench", "pareto", *room, "--face", 8, "--quiet", "-o", tmp_path)
    assert done.returncode == 0, done.stderr
    (part,) = last_json(done)["scenes"]
    rows = {(row["peer"], row["setting"]): row for row in part["rows"]}
    assert rows["Gridlight", "default"]["error"]["relative_rms"] < 0.1
    assert rows["Cycles panoramas", "64×32, 8 samples"]["error"]["relative_rms"] < 0.1
    for row in part["rows"]:
        assert row["seconds"] is not None or row["problem"]
    three = [row for row in part["rows"] if row["peer"] == "three.js"]
    assert three and (three[0]["problem"] if three[0]["seconds"] is None else three[-1]["error"]["relative_rms"] < 0.5)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".json", ".svg", ".txt"]


@pytest.mark.nightly
def test_frame_says_where_the_time_goes():
    reports = children({"peer": "frame", "scene": "cornell", "seconds": 60, "moves": 3, "settings": {"face": 8}})
    rows = {report["run"]: report for report in reports if "run" in report}
    assert {"slice", "relight, sliced", "picture", "relight, in one go", "bake, step", "bake, timer event"} <= set(rows)
    for row in rows.values():
        assert 0 < row["median"] <= row["percentile_99"] <= row["longest"]
    assert rows["bake, step"]["count"] >= rows["bake, timer event"]["count"] > 10
    assert rows["slice"]["count"] > rows["relight, sliced"]["count"]
    merged = {key: value for report in reports for key, value in report.items()}
    assert max(merged["longest_steps"].values()) == rows["bake, step"]["longest"]
    shaders = merged["shaders"]
    assert {"patch_direct_comp", "patch_iterate_comp", "field_project_comp"} <= set(shaders)
    assert sum(cost["seconds"] for cost in shaders.values()) < merged["profiled_seconds"]
    assert all(cost["bytes"] > 0 and cost["dispatches"] > 0 for cost in shaders.values())
    assert min(merged["limits"].values()) > 0


def test_a_browser_that_is_missing_is_named(monkeypatch):
    monkeypatch.setenv("PATH", "/nowhere")
    request = {"peer": "three", "scene": "cornell", "nodes": [], "settings": [], "software": True, "seconds": 9}
    reports, problem = bench_process.measure_in_child(request, 60, ["--quiet"], in_blender=False, verbose=False)
    assert "chromium is not here" in problem and "apt-get install" in problem


def test_unknown_benchmark_is_refused(run_gridlight):
    assert run_gridlight("bench", "nonsense").returncode == 2
