# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of ``eval``: points with normals in, the same rows with irradiance out, streamed block by block."""

from __future__ import annotations

import itertools

import numpy as np

from ..core.conventions import MOST_REACH_M
from ..core.errors import InputError

HEADER_IN = "x,y,z,nx,ny,nz"
HEADER_OUT = HEADER_IN + ",Er,Eg,Eb"
BLOCK_ROWS = 50_000


def read_blocks(file, name: str):
    """Yields (rows as text, values) per block of the open text file ``file``; ``values`` is (N, 6) float64 in that
    order.

    Blank lines are skipped. Normals come back with unit length.

    Raises:
        InputError: naming the line: a wrong header, a row that is not six finite numbers, a point too far away, a
            normal of length zero.
    """
    try:
        header = file.readline().lstrip("\ufeff")
        if [cell.strip() for cell in header.split(",")] != HEADER_IN.split(","):
            raise InputError(f"{name}, line 1: expected the header row {HEADER_IN}")
        number = 1
        while lines := list(itertools.islice(file, BLOCK_ROWS)):
            numbers = [number + 1 + index for index, line in enumerate(lines) if line.strip()]
            rows = [line.strip() for line in lines if line.strip()]
            number += len(lines)
            if rows:
                yield rows, _values(rows, numbers, name)
    except UnicodeDecodeError:
        raise InputError(f"{name} is not a text file; it must hold rows {HEADER_IN}") from None


def _values(rows: list[str], numbers: list[int], name: str) -> np.ndarray:
    try:
        values = np.array([row.split(",") for row in rows], dtype=float)
    except ValueError:
        values = np.empty(0)
    if values.ndim != 2 or values.shape[1] != 6:
        for row, number in zip(rows, numbers):
            if not _is_row(row):
                raise InputError(f"{name}, line {number}: '{row[:60]}' is not six numbers {HEADER_IN}")
    if not np.isfinite(values).all():
        bad = int(np.argmin(np.isfinite(values).all(axis=1)))
        raise InputError(f"{name}, line {numbers[bad]}: '{rows[bad][:60]}' holds a value that is not finite")
    farthest = np.abs(values[:, :3]).max(axis=1)
    if farthest.max(initial=0.0) > MOST_REACH_M:
        far = int(np.argmax(farthest))
        raise InputError(
            f"{name}, line {numbers[far]}: the point is farther away than {MOST_REACH_M:g} m; bring it nearer"
        )
    normals = values[:, 3:]
    # Scaled by the largest component first: the squares of tiny or huge numbers leave the range of float64.
    largest = np.abs(normals).max(axis=1)
    if not largest.all():
        bad = int(np.argmin(largest > 0))
        raise InputError(f"{name}, line {numbers[bad]}: the normal has length zero; give it a direction")
    normals /= largest[:, None]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return values


def _is_row(row: str) -> bool:
    cells = row.split(",")
    try:
        return len(cells) == 6 and all(float(cell) is not None for cell in cells)
    except ValueError:
        return False


def format_rows(rows: list[str], irradiance: np.ndarray) -> str:
    """The rows as they came in, each with its (3,) irradiance, nine significant digits: enough to restore float32."""
    return "".join(f"{row},{r:.9g},{g:.9g},{b:.9g}\n" for row, (r, g, b) in zip(rows, irradiance.tolist()))
