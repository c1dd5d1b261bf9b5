# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of benchmarks as plain text: aligned columns, numbers with three digits."""

from __future__ import annotations


def columns(cells: list[list[str]], left: int = 1) -> list[str]:
    """``cells`` as lines with aligned columns, the first ``left`` to the left. The last cell of a row that is shorter
    than the first one may stick out."""
    full = len(cells[0])
    widths = [
        max(len(line[column]) for line in cells if len(line) == full or column < len(line) - 1)
        for column in range(full)
    ]
    return [
        "  ".join(
            cell.ljust(width) if column < left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths))
        ).rstrip()
        for line in cells
    ]


def significant(value: float) -> str:
    """Three significant digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.6f}" if value < 1e-3 else f"{value:#.3g}"
