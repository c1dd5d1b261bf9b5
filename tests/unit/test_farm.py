# SPDX-License-Identifier: GPL-3.0-or-later
"""The farm without Blender: files that know their content, shards, the cost model."""

import json
import os

import numpy as np
import pytest
from gridlight.core.camera import look
from gridlight.core.errors import InputError
from gridlight.core.snapshot import Image, Light, Material, SceneSnapshot, World
from gridlight.farm import container, cost
from gridlight.farm.job import VERSION, Job
from gridlight.farm.partition import divide
from gridlight.farm.scene_file import SceneReader, write_scene
from gridlight.farm.shard import chosen
from gridlight.formats.probe_metadata import scene_hash


def test_a_container_holds_what_was_put_in(tmp_path):
    arrays = {"a": np.arange(6, dtype=">f8").reshape(2, 3), "b": np.zeros((0, 4), np.uint8), "c": np.array([True])}
    path = container.write(tmp_path, "x", {"text": "ü", "number": 0.1}, arrays)
    again = container.write(tmp_path, "x", {"number": 0.1, "text": "ü"}, arrays)
    assert path == again and [p.name for p in tmp_path.iterdir()] == [path.name]
    container.check(path)
    header, found = container.arrays(path)
    assert header == {"text": "ü", "number": 0.1} == {k: v for k, v in container.header(path).items() if k != "arrays"}
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize("change", [lambda b: b[:-1], lambda b: b"", lambda b: b[:20] + b"x" + b[21:]])
def test_a_damaged_container_is_found(change, tmp_path):
    path = container.write(tmp_path, "x", {}, {"a": np.arange(9)})
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(container.Damaged, match="hash"):
        container.check(path)


def test_a_scene_is_read_back_bit_by_bit(tmp_path):
    generator = np.random.default_rng(0)
    matrix = generator.normal(size=(4, 4))
    snapshot = SceneSnapshot(
        generator.normal(size=(9, 3)) * 1e6,
        np.arange(9, dtype=np.int32).reshape(3, 3),
        generator.normal(size=(3, 3, 3)).astype(np.float32),
        generator.random((3, 3, 2)).astype(np.float32),
        np.array([0, 1, 1], np.int32),
        np.zeros(3, np.int32),
        ["thing ü"],
        [Material("a", (0.1, 1 / 3, np.float32(0.7))), Material("b", alpha_image=0, alpha_threshold=0.5)],
        [Image("i", generator.random((2, 3, 4)).astype(np.float32), "CLIP")],
        [Light("l", "SPOT", (1e-300, np.pi, 3.0), matrix, spot_scale=(1.0, 0.1, 2.0))],
        World((0.1, 0.2, 0.3), generator.random((4, 8, 3)).astype(np.float32)),
        camera=look((1.0, 2.0, 1e-7), (0.0, 0.0, 1 / 3), 1.5),
        exposure=0.1,
        frame=-3,
        name="S",
    )
    document = json.loads(json.dumps(write_scene(tmp_path, snapshot)))
    reader = SceneReader(tmp_path)
    found = reader.read(document)
    for name in ("vertices", "triangles", "corner_normals", "corner_uvs", "material_index", "object_index"):
        np.testing.assert_array_equal(getattr(found, name), getattr(snapshot, name))
        assert getattr(found, name).dtype == getattr(snapshot, name).dtype
    assert found.materials == snapshot.materials and found.object_names == snapshot.object_names
    np.testing.assert_array_equal(found.images[0].pixels, snapshot.images[0].pixels)
    np.testing.assert_array_equal(found.lights[0].matrix, matrix)
    assert found.lights[0].color == snapshot.lights[0].color and found.lights[0].spot_scale == (1.0, 0.1, 2.0)
    np.testing.assert_array_equal(found.world.map, snapshot.world.map)
    assert (found.frame, found.name, found.exposure) == (-3, "S", 0.1)
    for name in ("position", "right", "up", "forward"):
        np.testing.assert_array_equal(getattr(found.camera, name), getattr(snapshot.camera, name))
    assert scene_hash(found) == scene_hash(snapshot)
    assert reader.read(document).vertices is found.vertices  # arrays that stay are not read again


@pytest.mark.parametrize("shards", [1, 2, 3, 5, 7, 100, None])
def test_shards_hold_every_block_once_in_runs_of_like_size(shards):
    active = {index: count for index, count in enumerate([0, 5, 900, 1000, 10, 1000, 950, 1000]) if count}
    parts = divide(active, shards)
    assert [block for part in parts for block in part] == sorted(active)
    assert len(parts) == min(shards or 7, 7) and all(parts)
    if shards == 2:
        sizes = [sum(active[block] for block in part) for part in parts]
        assert max(sizes) <= 0.6 * sum(sizes)


def job_of(folder, shards=5):
    frames = [{"frame": 1, "volumes": [{"name": "v"}]}]
    plan = {"version": VERSION, "frames": frames, "shards": [[0, 0, [i]] for i in range(shards)]}
    container.write_bytes(folder, "plan", [json.dumps(plan).encode()], ".json")
    return Job(folder)


def test_shares_cover_every_shard_once(tmp_path):
    job = job_of(tmp_path)
    for count in (1, 2, 5, 9):
        numbers = [shard.number for share in range(count) for shard in chosen(job, f"{share}/{count}")]
        assert sorted(numbers) == [0, 1, 2, 3, 4]
    assert [shard.number for shard in chosen(job, "3")] == [3] and chosen(job, "7/9") == []
    for wrong in ("5", "-1", "x", "2/2", "1/", "/3"):
        with pytest.raises(InputError):
            chosen(job, wrong)


def test_a_folder_without_its_plan_is_refused(tmp_path):
    with pytest.raises(InputError, match="farm plan"):
        Job(tmp_path)
    job = job_of(tmp_path)
    job.path.write_text("{}")
    with pytest.raises(InputError, match="damaged"):
        Job(tmp_path)


def test_a_lookup_trusts_content_not_names(tmp_path):
    job = job_of(tmp_path)
    path = job.write_output(0, job.shards[1], {"x": 1}, {})
    assert job.output(0, job.shards[1]) == path and job.output(0, job.shards[0]) is None
    other = job.write_output(0, job.shards[1], {"x": 2}, {})
    assert not path.exists() and job.output(0, job.shards[1]) == other  # one output a shard
    (tmp_path / "votes" / ".00001.123.part").write_bytes(other.read_bytes())
    os.truncate(other, 10)
    assert job.output(0, job.shards[1]) is None and not other.exists()
    assert [event["event"] for event in job.events()] == ["damaged"]


def plan_of(blocks, active, memory_mib=512):
    volume = {"active": [active] * blocks}
    return {
        "settings": {"face": 16, "memory_mib": memory_mib},
        "frames": [{"volumes": [volume]}],
        "shards": [[0, 0, [index]] for index in range(blocks)],
    }


def test_the_cost_model_adds_up():
    model = cost.CostModel(cost.Line(1.0, 0.001), cost.Line(2.0, 0.004), 3.0, 1e9)
    overhead = cost.START_SECONDS + 3.0 + 0.02 * 1 + cost.MERGE_SECONDS * 8000
    one, many = (model.seconds(plan_of(8, 1000, 1 << 14), workers) for workers in (1, 8))
    assert one == pytest.approx(overhead + 8 * (2.0 + 6.0 + 0.04))
    assert many == pytest.approx(overhead + 2.0 + 6.0 + 0.04)
    small = model.seconds(plan_of(8, 1000, 64), 1)
    assert small == pytest.approx(one + 8 * 2.0)  # surfaces that do not stay are captured twice
    lines = cost.table(model, plan_of(8, 1000))
    assert len(lines) == 1 + 4 + 2 and "shards: 8, of 8 blocks" in lines[-1]


def test_a_line_goes_through_what_was_measured():
    line = cost.Line.through([100, 500], [1.5, 3.5])
    assert (line(100), line(500), line.fixed) == pytest.approx((1.5, 3.5, 1.0))
    assert cost.Line.through([50], [2.0])(100) == pytest.approx(4.0)
    assert cost.Line.through([10, 20], [1.0, 0.5]).each == 0.0


def test_more_workers_help_until_the_parts_that_do_not_divide():
    model = cost.CostModel(cost.Line(0.2, 2e-4), cost.Line(0.5, 5e-4), 1.0, 1e9)
    totals = [sum(cost.on_paper(model, 10**7, 4096, workers, 2e9, 10**4).values()) for workers in (1, 10, 100, 1000)]
    assert totals[0] > 5 * totals[1] > 5 * totals[2]  # nearly linear
    assert totals[3] > totals[2]  # every worker reads the scene from one storage
