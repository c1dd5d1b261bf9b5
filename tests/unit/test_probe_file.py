# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe file: exact round trip, the layout that other readers rely on, and every way in which a file can be bad."""

import json

import numpy as np
import OpenEXR
import pytest
from gridlight.core.conventions import DEPTH_EDGE, coefficient_names
from gridlight.core.errors import InputError
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import probe_file
from hypothesis import given, settings
from hypothesis import strategies as st


def random_field(resolution=(3, 4, 2), bands=3, seed=0) -> Field:
    rng = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    grid = Grid(matrix, resolution, "Volume “A”")
    count = grid.count
    return Field(
        grid,
        rng.normal(size=(count, bands * bands, 3)).astype(np.float32),
        rng.integers(0, 3, count).astype(np.uint8),
        rng.random(count, np.float32),
        rng.normal(size=(count, 3)).astype(np.float32),
        rng.random((count, DEPTH_EDGE**2, 4), np.float32),
        {"device": "test", "settings": {"bands": bands}, "scene_hash": "0", "warnings": ["one"]},
        rng.normal(size=(count, 3, min(bands, 3) ** 2, 3)).astype(np.float32),
    )


@pytest.fixture
def written(tmp_path):
    """(path, field) of a good file."""
    field = random_field()
    path = tmp_path / "probes.exr"
    probe_file.write(path, field)
    return path, field


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.integers(1, 5)] * 3), st.integers(1, 4), st.integers(0, 1000))
def test_round_trip_is_exact(tmp_path_factory, resolution, bands, seed):
    field = random_field(resolution, bands, seed)
    path = tmp_path_factory.mktemp("round") / "probes.exr"
    probe_file.write(path, field)
    back = probe_file.read(path)
    assert back.grid.resolution == field.grid.resolution and back.grid.name == field.grid.name and back.bands == bands
    assert np.array_equal(back.grid.matrix, field.grid.matrix)
    for name in ("coefficients", "state", "validity", "offset", "depth", "gradient"):
        mine, theirs = getattr(field, name), getattr(back, name)
        assert mine.dtype == theirs.dtype and np.array_equal(mine, theirs), name
    assert {key: back.metadata[key] for key in field.metadata} == field.metadata


def test_the_same_field_gives_the_same_bytes_also_after_reading(written, tmp_path):
    path, _field = written
    again = tmp_path / "again.exr"
    probe_file.write(again, probe_file.read(path))
    assert again.read_bytes() == path.read_bytes()


def test_layout_for_other_readers(written):
    """Row = j + ny·k, column = i, named channels, 32-bit float: read here with OpenEXR alone."""
    path, field = written
    file = OpenEXR.File(str(path), separate_channels=True)
    nx, ny, nz = field.grid.resolution
    channels = file.channels()
    expected = {f"{name}.{color}" for name in coefficient_names(3) for color in "RGB"} | {"state", "validity"}
    expected |= {f"offset.{axis}" for axis in "XYZ"} | {
        f"depth.{s}.{t:02d}" for s in ("mean", "meansq", "normal", "middle") for t in range(64)
    }
    expected |= {f"d{axis}.{name}.{color}" for axis in "XYZ" for name in coefficient_names(3) for color in "RGB"}
    assert set(channels) == expected
    for i, j, k in [(0, 0, 0), (2, 1, 0), (1, 3, 1), (2, 3, 1)]:
        flat = i + nx * (j + ny * k)
        assert channels["L1m1.G"].pixels[j + ny * k, i] == field.coefficients[flat, 1, 1]
        assert channels["state"].pixels[j + ny * k, i] == field.state[flat]
        assert channels["offset.Z"].pixels[j + ny * k, i] == field.offset[flat, 2]
        assert channels["depth.meansq.17"].pixels[j + ny * k, i] == field.depth[flat, 17, 1]
        assert channels["depth.normal.63"].pixels[j + ny * k, i] == field.depth[flat, 63, 2]
        assert channels["depth.middle.05"].pixels[j + ny * k, i] == field.depth[flat, 5, 3]
        assert channels["dY.L2m1.B"].pixels[j + ny * k, i] == field.gradient[flat, 1, 5, 2]
    assert channels["validity"].pixels.dtype == np.float32 and channels["validity"].pixels.shape == (ny * nz, nx)
    document = json.loads(file.header()["gridlight"])
    assert document["resolution"] == [nx, ny, nz] and document["bands"] == 3 and document["format_version"][0] == 1
    assert np.array_equal(np.array(document["volume"]["matrix"]), field.grid.matrix)


def edited(path, change, channels_change=None):
    """The file with its JSON object passed through ``change`` and its channels through ``channels_change``."""
    file = OpenEXR.File(str(path), separate_channels=True)
    document = json.loads(file.header()["gridlight"])
    document.pop("digest")
    channels = {name: np.ascontiguousarray(channel.pixels) for name, channel in file.channels().items()}
    document = change(document) or document
    if channels_change:
        channels = channels_change(channels) or channels
    text = document if isinstance(document, str) else json.dumps(document)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "gridlight": text}
    OpenEXR.File(header, channels).write(str(path))


def test_a_file_by_another_program_needs_no_digest(written):
    path, field = written
    edited(path, lambda document: None)
    assert np.array_equal(probe_file.read(path).coefficients, field.coefficients)


def test_a_file_of_format_1_0_has_no_gradient(written):
    path, field = written

    def without(channels):
        return {name: pixels for name, pixels in channels.items() if name[:2] not in ("dX", "dY", "dZ")}

    edited(path, set_key("format_version", value=[1, 0]), without)
    back = probe_file.read(path)
    assert np.array_equal(back.coefficients, field.coefficients)
    assert back.gradient.shape == field.gradient.shape and not back.gradient.any()


def test_a_file_before_1_2_knows_moments_only(written):
    path, field = written

    def without(channels):
        return {
            name: pixels for name, pixels in channels.items() if not name.startswith(("depth.normal", "depth.middle"))
        }

    edited(path, set_key("format_version", value=[1, 1]), without)
    back = probe_file.read(path)
    assert np.array_equal(back.gradient, field.gradient) and np.array_equal(back.depth[..., :2], field.depth[..., :2])
    assert not back.depth[..., 2:].any()


def test_gradients_are_there_whole_or_not_at_all(written):
    path, _field = written
    edited(path, lambda document: None, lambda channels: {key: v for key, v in channels.items() if key != "dZ.L22.B"})
    with pytest.raises(InputError, match="channel dZ.L22.B is missing"):
        probe_file.read(path)


def set_key(*keys, value):
    def change(document):
        inner = document
        for key in keys[:-1]:
            inner = inner[key]
        inner[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (set_key("format_version", value=[2, 0]), "format version 2.0"),
        (set_key("format_version", value="1.0"), "format version is missing"),
        (set_key("resolution", value=[3, 4, 3]), "pixels for a resolution"),
        (set_key("resolution", value=[4, 3, 2]), "pixels for a resolution"),
        (set_key("resolution", value=[0, 4, 2]), "1 to 256"),
        (set_key("resolution", value=[3, 4]), "make no sense"),
        (set_key("resolution", value=[3.0, 4, 2]), "make no sense"),
        (set_key("resolution", value=[256, 256, 256]), "MiB"),
        (set_key("bands", value=4), "channel L3m3.R is missing"),
        (set_key("bands", value=10**9), "make no sense"),
        (set_key("bands", value=True), "make no sense"),
        (set_key("volume", value={}), "incomplete"),
        (set_key("volume", "matrix", value=[[1, 0], [0, 1]]), "make no sense"),
        (set_key("volume", "matrix", value=[["a"] * 4] * 4), "incomplete"),
        (set_key("volume", "matrix", value=[[0] * 4] * 4), "no volume|zero size"),
        (set_key("volume", "matrix", value=[[float("nan")] * 4] * 4), "not finite"),
        (lambda document: "{", "not JSON"),
        (lambda document: "[1]", "not a JSON object"),
        (lambda document: "[" * 100_000, "not JSON|damaged"),
    ],
)
def test_contradictions_in_the_description_are_refused(written, change, words):
    path, _field = written
    edited(path, change)
    with pytest.raises(InputError, match=words) as caught:
        probe_file.read(path)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("L00.R", np.nan, "L00.R holds values that are not finite"),
        ("depth.mean.63", np.inf, "depth.mean.63"),
        ("state", 3, "states"),
        ("state", 0.5, "states"),
        ("validity", None, "validity is missing"),
    ],
)
def test_bad_pixels_are_refused(written, name, value, words):
    path, _field = written

    def change(channels):
        if value is None:
            del channels[name]
        else:
            channels[name][2, 1] = value

    edited(path, lambda document: None, change)
    with pytest.raises(InputError, match=words):
        probe_file.read(path)


def test_half_floats_are_refused(written):
    path, _field = written

    def halve(channels):
        channels["L00.R"] = channels["L00.R"].astype(np.float16)

    edited(path, lambda document: None, halve)
    with pytest.raises(InputError, match="32-bit float"):
        probe_file.read(path)


def test_a_newer_minor_version_and_unknown_keys_are_read(written):
    path, _field = written
    edited(path, lambda document: {**document, "format_version": [1, 9], "later": 1})
    assert probe_file.read(path).metadata["later"] == 1


def test_every_truncation_is_refused_with_one_line(written, capfd):
    path, _field = written
    data = path.read_bytes()
    for length in [*range(0, 64), *range(64, len(data), len(data) // 60), len(data) - 1]:
        path.write_bytes(data[:length])
        with pytest.raises(InputError) as caught:
            probe_file.read(path)
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", ""), "OpenEXR's own messages must not reach the user"


def test_no_flipped_bit_goes_unnoticed_in_the_numbers(written):
    """Either the file is refused or everything in it is still right (a bit in the file's padding or names of no
    use)."""
    path, field = written
    data = path.read_bytes()
    rng = np.random.default_rng(1)
    refused = 0
    for position in [*rng.integers(0, len(data), 250), *rng.integers(0, 400, 50)]:
        damaged = bytearray(data)
        damaged[position] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            back = probe_file.read(path)
        except InputError:
            refused += 1
        else:
            assert np.array_equal(back.coefficients, field.coefficients) and np.array_equal(back.depth, field.depth)
            assert np.array_equal(back.grid.matrix, field.grid.matrix)
    assert refused > 250


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x89PNG\r\n\x1a\n", b"BLENDER-v500"])
def test_other_files_are_named_as_such(tmp_path, content):
    path = tmp_path / "other.exr"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is not an OpenEXR file"):
        probe_file.read(path)


def test_an_ordinary_image_is_named_as_such(tmp_path):
    path = tmp_path / "image.exr"
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"R": np.zeros((2, 2), np.float32)}).write(str(path))
    with pytest.raises(InputError, match="without Gridlight's data"):
        probe_file.read(path)


def test_a_missing_file_and_a_folder(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        probe_file.read(tmp_path / "none.exr")
    with pytest.raises(InputError, match="directory"):
        probe_file.read(tmp_path)


def test_writing_refuses_values_that_are_not_finite(tmp_path):
    field = random_field()
    field.validity[3] = np.nan
    with pytest.raises(InputError, match="validity"):
        probe_file.write(tmp_path / "probes.exr", field)
    assert not list(tmp_path.iterdir())


def test_writing_to_a_full_disk_says_so():
    with pytest.raises(OSError, match="No space left"):
        probe_file.write("/dev/full", random_field())


def test_too_large_a_grid_is_refused_before_the_work():
    with pytest.raises(InputError, match="limit"):
        probe_file.check_size(Grid(np.eye(4), (256, 256, 256)), 3)
    probe_file.check_size(Grid(np.eye(4), (100, 100, 100)), 4)
