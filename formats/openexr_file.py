# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing through OpenEXR's Python binding, and the ways of that binding."""

from __future__ import annotations

import contextlib
import io
import os
import sys

import numpy as np


def write(path, header: dict, channels: dict[str, np.ndarray]) -> None:
    """Writes one part of scanlines: ``channels`` (height, width) float32 or float16 each, row 0 on top.

    Raises:
        OSError: the file cannot be written.
    """
    import OpenEXR

    # The binding writes strided arrays as if they were contiguous.
    planes = {name: np.ascontiguousarray(plane) for name, plane in channels.items()}
    # OpenEXR reports every failure as RuntimeError with its own wording; opening the file first gives the system's.
    with open(path, "wb"):
        pass
    try:
        with silent():
            OpenEXR.File(header, planes).write(os.fspath(path))
    except RuntimeError as error:
        raise OSError(None, f"writing failed: {reason(error)}", str(path)) from None


def write_image(path, pixels: np.ndarray, attributes: dict[str, str] | None = None) -> None:
    """Writes ``pixels`` (height, width, 3 or 4) float32 or float16, row 0 on top, as R, G, B and A; ZIP."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(attributes or {})}
    write(path, header, {name: pixels[..., index] for index, name in enumerate("RGBA"[: pixels.shape[-1]])})


def reason(error: Exception) -> str:
    """OpenEXR's own words on one line."""
    return " ".join(str(error).split())[:200] or type(error).__name__


@contextlib.contextmanager
def silent():
    """OpenEXR raises its errors and prints them too, on both standard streams; the user gets one line, ours."""
    null = os.open(os.devnull, os.O_WRONLY)
    kept = {}
    for descriptor, stream in ((1, sys.stdout), (2, sys.stderr)):
        if stream is not None:  # None in Blender on Windows started without a console
            stream.flush()
            kept[descriptor] = os.dup(descriptor)
            os.dup2(null, descriptor)
    os.close(null)
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            yield
    finally:
        for descriptor, copy in kept.items():
            os.dup2(copy, descriptor)
            os.close(copy)
