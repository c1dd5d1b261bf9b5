# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that were looked at and are kept in tests/images: what is seen must be like them.

With GRIDLIGHT_BLESS=1 in the environment what is seen becomes the reference; look at it before you commit it. Where
one differs, the test's pictures hold what was seen and the difference, ten times as strong.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np

IMAGES = Path(__file__).resolve().parents[1] / "images"
COARSE = 2  # pixels along the edge of what is compared: drivers draw edges by rules of their own
MEAN, EACH, SHARE = 0.012, 0.08, 0.985  # most mean difference; most of a pixel, for so many of them (0..1)
_QUALITY = "92"


def coarse(pixels: np.ndarray) -> np.ndarray:
    """(h, w, 3) 0..1 means over COARSE² of ``pixels`` (height, width, 3) uint8."""
    height, width = (size // COARSE for size in pixels.shape[:2])
    whole = pixels[: height * COARSE, : width * COARSE].astype(float) / 255
    return whole.reshape(height, COARSE, width, COARSE, 3).mean(axis=(1, 3))


def is_blessing() -> bool:
    return bool(os.environ.get("GRIDLIGHT_BLESS"))


def check(name: str, seen: np.ndarray) -> None:
    """Holds ``seen`` (h, w, 3) 0..1, row 0 at the top, against the reference ``name``.

    Raises:
        AssertionError: they differ, or there is no reference.
    """
    path = IMAGES / f"{name}.jpg"
    if is_blessing():
        _write(path, seen)
        return
    assert path.exists(), f"{path} is missing; look at what is seen and run again with GRIDLIGHT_BLESS=1"
    expected = _read(path)
    problem = ""
    if seen.shape != expected.shape:
        problem = f"{seen.shape} pixels instead of {expected.shape}"
    else:
        difference = np.abs(seen - expected)
        near = (difference.max(axis=2) <= EACH).mean()
        if difference.mean() > MEAN or near < SHARE:
            problem = f"mean difference {difference.mean():.4f}, {near:.3%} of the pixels are alike"
            _write(_kept(f"{name}-difference"), np.clip(10 * difference, 0, 1))
    if problem:
        _write(_kept(f"{name}-seen"), seen)
        raise AssertionError(f"'{name}' is not like {path}: {problem}")


def _kept(name: str) -> Path:
    return Path(os.environ["GRIDLIGHT_PICTURES"]) / f"{name}.png"


def _read(path: Path) -> np.ndarray:
    raw = subprocess.run(["convert", str(path), "-depth", "8", "ppm:-"], capture_output=True, check=True).stdout
    _, size, _, data = raw.split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(data, np.uint8).reshape(height, width, 3) / 255


def _write(path: Path, pixels: np.ndarray) -> None:
    height, width = pixels.shape[:2]
    data = b"P6\n%d %d\n255\n" % (width, height) + np.rint(pixels * 255).astype(np.uint8).tobytes()
    subprocess.run(["convert", "ppm:-", "-quality", _QUALITY, str(path)], input=data, check=True)
