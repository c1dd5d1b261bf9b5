# SPDX-License-Identifier: GPL-3.0-or-later
"""The HTML report: self-contained, escaped, whole or absent, and its pictures show the probes where they are."""

import base64
import hashlib
import re
import struct
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest
from gridlight.core.conventions import CULLED, INVALID
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import report_figures, report_slices
from gridlight.formats.report import ReportData, VolumeReport, report_html, write_report

EVIL = "<script>alert('x')</script>\"'&"


def a_field(resolution=(4, 3, 2), name="Hall") -> Field:
    field = Field.empty(Grid.from_bounds((0, 0, 0), (3, 2, 1), resolution, name), 3)
    field.coefficients[:, 0] = np.linspace(1, 2, field.grid.count)[:, None]
    field.state[1:2], field.state[2:3] = CULLED, INVALID
    return field


def a_report(**changes) -> ReportData:
    volume = VolumeReport(
        a_field(), "Hall", [1.0, 1.5, 1.6, 1.61], [0.5, 0.07, 0.006], 4, True, ["raster, because it is cheap"]
    )
    values = dict(
        title="Gallery",
        volumes=[volume],
        settings={"tolerance": 2e-3},
        device="llvmpipe",
        blender="5.2.3",
        counts={"total": 24, "active": 22, "culled": 1, "invalid": 1},
        seconds={"read": 0.1, "light": 1.5, "total": 1.7},
        notes=["trace: 24 probes"],
        warnings=["hair is left out"],
        summary={"iterations": 4},
    )
    return ReportData(**{**values, **changes})


class Page(HTMLParser):
    """Collects elements and checks that they are closed in order."""

    VOID = {"meta", "img", "input", "br"}

    def __init__(self, text):
        super().__init__()
        self.stack, self.elements = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        if tag not in self.VOID:
            self.stack.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def count(self, tag):
        return sum(name == tag for name, _ in self.elements)


def test_a_page_is_well_formed_and_loads_nothing():
    text = report_html(a_report(images=[("Preview", b"\x89PNG")]))
    page = Page(text)
    assert page.stack == []
    for tag, attributes in page.elements:
        for name in ("src", "href"):
            assert attributes.get(name, "data:").startswith(("data:", "#")), (tag, attributes)
    assert not re.search(r"https?://|@import|url\((?!data:)", text)
    for expected in (
        "Hall",
        "llvmpipe",
        "5.2.3",
        "hair is left out",
        "trace: 24 probes",
        "raster, because it is cheap",
        "1.5",
    ):
        assert expected in text


def test_nothing_from_the_file_becomes_markup():
    field = a_field(name=EVIL)
    report = a_report(
        title=EVIL,
        volumes=[VolumeReport(field, EVIL, [1.0], [], 1, False, [EVIL])],
        settings={EVIL: EVIL},
        device=EVIL,
        blender=EVIL,
        generator=EVIL,
        seconds={EVIL: 1.0},
        notes=[EVIL],
        warnings=[EVIL],
        images=[(EVIL, b"")],
        summary={EVIL: [EVIL]},
    )
    text = report_html(report)
    page = Page(text)
    assert page.stack == [] and page.count("script") == 1
    assert "<script>alert" not in text
    assert text.count("&lt;script&gt;alert") >= 12


def test_what_a_bake_says_of_its_error_is_told():
    error = {
        "target": 0.02,
        "met": False,
        "predicted": 0.0312,
        "predicted_at_most": 0.035,
        "parts": {"texels": 0.01, "noise": 0.0, "rest": 0.0, "bounces": 0.001, "floor": 0.029},
        "between": None,
        "passes": ["face 8, samples 1, 9 probes"],
        "paths": 4096,
        "stopped": EVIL,
        "bands": {"1": 0, "2": 4, "3": 5},
    }
    text = report_html(a_report(volumes=[VolumeReport(a_field(), error=error)]))
    Page(text)
    assert EVIL not in text and all(part in text for part in ("3.12 %", "2.90 %", "unknown", "4 with 2, 5 with 3"))
    silent = {"target": 0.02, "met": None, "predicted": None, "reason": EVIL}
    text = report_html(a_report(volumes=[VolumeReport(a_field(), error=silent)]))
    assert EVIL not in text and "Not estimated" in text


def test_only_the_pages_own_script_may_run():
    text = report_html(a_report())
    script = re.search(r"<script>(.*)</script>", text, re.DOTALL).group(1)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in text and "default-src 'none'" in text


@pytest.mark.parametrize(
    "volume",
    [
        VolumeReport(a_field((1, 1, 1))),
        VolumeReport(
            Field.empty(Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 2, 2)), 1), energy=[0.0, 0.0], change=[0.0]
        ),
        VolumeReport(a_field((3, 3, 40)), energy=[1.0, float("nan")], change=[float("inf")]),
    ],
)
def test_odd_fields_still_make_a_page(volume):
    with np.errstate(all="raise"):
        assert Page(report_html(a_report(volumes=[volume]))).stack == []


def test_a_field_without_an_active_probe_makes_a_page():
    field = a_field()
    field.state[:] = CULLED
    assert "no active probe" in report_html(a_report(volumes=[VolumeReport(field)]))


def test_writing_is_all_or_nothing(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    write_report(path, a_report(title="Lone \udc80 surrogate"))
    first = path.read_text(encoding="utf-8")
    assert first.startswith("<!DOCTYPE html>")

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full_disk)
    with pytest.raises(OSError, match="No space"):
        write_report(path, a_report(title="Second"))
    assert [item.name for item in tmp_path.iterdir()] == ["report.html"]
    assert path.read_text(encoding="utf-8") == first


def decode_png(data: bytes) -> np.ndarray:
    """(height, width, 4) of an unfiltered RGBA PNG; checks the checksums."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        chunks[kind] = body
        at += 12 + length
    width, height, depth, colour = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    assert (depth, colour) == (8, 6)
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + 4 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 4)


def test_png_round_trip():
    pixels = np.random.default_rng(0).integers(0, 256, (5, 7, 4), dtype=np.uint8)
    assert np.array_equal(decode_png(report_slices.png(pixels)), pixels)


def test_slices_show_each_probe_in_its_place():
    field = a_field()
    html = report_slices.slices_html(field, "v")
    atlases = {
        key: decode_png(base64.b64decode(data))
        for key, data in re.findall(r'data-key="(\w+)" style="--atlas:url\(data:image/png;base64,([^)]*)\)', html)
    }
    assert set(atlases) == {"up", "mean", "colour", "state"}
    # Nodes 1 and 2 stand in the lowest level at j = 0: the bottom row of the first of two blocks of three rows.
    for atlas in atlases.values():
        assert atlas.shape == (6, 4, 4)
        assert atlas[2, 1, 3] == 0 and (atlas[..., 3] == 0).sum() == 1
        assert tuple(atlas[2, 2, :3]) == report_slices.INVALID_COLOUR
    luminance = atlases["mean"][..., :3] @ np.array([0.2, 0.7, 0.1])
    order = luminance.reshape(2, 3, 4)[:, ::-1].ravel()[3:]  # brightness rises with the flat index in this field
    assert (np.diff(order) >= -1).all() and order[-1] > order[0] + 20


def test_quantities_against_closed_forms():
    field = a_field()
    field.coefficients[:] = 0
    field.coefficients[:, 0] = np.sqrt(4 * np.pi) * 0.7  # uniform radiance 0.7
    found = {quantity.key: quantity.values for quantity in report_slices.quantities(field)}
    assert np.allclose(found["mean"], 0.7, rtol=1e-6)
    assert np.allclose(found["up"], np.pi * 0.7, rtol=1e-6)


@pytest.mark.parametrize(("value", "text"), [(0, "0"), (1234.5, "1.23e+03"), (0.01234, "0.0123"), (1e-7, "1.00e-07")])
def test_numbers(value, text):
    assert report_figures.number(value) == text


@pytest.mark.parametrize(
    ("seconds", "text"), [(5e-5, "50 µs"), (0.0123, "12.3 ms"), (3.456, "3.46 s"), (600, "10.0 min")]
)
def test_durations(seconds, text):
    assert report_figures.duration(seconds) == text


def test_curve_draws_every_finite_value():
    svg = report_figures.curve([1.0, 2.0, float("nan"), 4.0], "Energy")
    assert svg.count("<circle") == 3
    heights = [float(value) for value in re.findall(r'cy="([\d.]+)"', svg)]
    assert heights == sorted(heights, reverse=True)  # larger is higher
    logarithmic = report_figures.curve([1e-1, 1e-2, 1e-3], "Change", True, 2e-3, "tolerance")
    heights = [float(value) for value in re.findall(r'cy="([\d.]+)"', logarithmic)]
    assert heights[1] - heights[0] == pytest.approx(heights[2] - heights[1], abs=0.11)
