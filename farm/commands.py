# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of ``gridlight farm``, run by the same machinery as those of ``gridlight`` itself."""

from __future__ import annotations

from pathlib import Path

from ..cli.main import Family
from ..cli.main import main as run_command_line

FAMILY = Family(
    package=__package__,
    names=("plan", "shard", "merge", "run", "status", "worker", "serve"),
    program="gridlight farm",
    description="Bakes in shards, on one machine or many. docs/farm.md explains how.",
    start=Path(__file__).with_name("__main__.py"),
)


def main(argv: list[str]) -> int:
    return run_command_line(argv, family=FAMILY)
