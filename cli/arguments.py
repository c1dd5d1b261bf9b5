# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading the command line: a parser that fails with one line, and the value types of the options."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path

from ..core.errors import InputError


class Given(argparse.Action):
    """Stores an option's value and notes in ``namespace.given``, a set of names, that it was given."""

    def __call__(self, parser, namespace, values, option_string=None):
        setattr(namespace, self.dest, values)
        namespace.given = getattr(namespace, "given", frozenset()) | {self.dest}


class Parser(argparse.ArgumentParser):
    """argparse whose errors are one plain line, raised as InputError."""

    def __init__(self, **options):
        super().__init__(allow_abbrev=False, **options)
        # In place of argparse's "invalid int value".
        self.register("type", int, whole)
        self.register("type", float, number)

    def error(self, message):
        raise InputError(f"{' '.join(message.split())} ('{self.prog} --help' lists the options)")


def join_signed_values(argv: list[str]) -> list[str]:
    """``argv`` with ``--min -1,-2,0`` written as ``--min=-1,-2,0``: argparse takes what begins with a minus sign for
    another option."""
    joined: list[str] = []
    for index, word in enumerate(argv):
        if word == "--":
            return [*joined, *argv[index:]]
        before = argv[index - 1] if index else ""
        if before.startswith("--") and "=" not in before and word.startswith("-") and _is_value(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _is_value(word: str) -> bool:
    """Is it a number, or several, or axes like -x,z,y, or a range of frames?"""
    first = word.split(",")[0]
    if first[1:].lower() in ("x", "y", "z") or re.fullmatch(r"-\d+--?\d+", word):
        return True
    try:
        float(first)
    except ValueError:
        return False
    return True


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number") from None


def number(text: str) -> float:
    """A number; the range is the option's business."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number") from None


def point(text: str) -> tuple[float, float, float]:
    """``X,Y,Z`` in metres, finite."""
    parts = text.split(",")
    try:
        values = tuple(float(part) for part in parts)
    except ValueError:
        values = ()
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise argparse.ArgumentTypeError(f"'{text}' is not three finite numbers X,Y,Z")
    return values


def counts(text: str) -> tuple[int, int, int]:
    """``NX,NY,NZ``; the range is the grid's business."""
    try:
        values = tuple(int(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"'{text}' is not three whole numbers NX,NY,NZ")
    return values


def length(text: str) -> float:
    """A positive, finite length in metres."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a length in metres greater than 0")
    return value


def bounces(text: str) -> int | None:
    """A number of bounces; None for ``auto``."""
    if text == "auto":
        return None
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is neither a whole number nor auto") from None


def frames(text: str) -> list[int]:
    """``A-B``, both included; either may be negative."""
    found = re.fullmatch(r"(-?\d+)-(-?\d+)", text)
    first, last = map(int, found.groups()) if found else (1, 0)
    if last < first:
        raise argparse.ArgumentTypeError(f"'{text}' is not a range of frames A-B")
    return list(range(first, last + 1))


def check_exists(*paths: str | Path) -> None:
    """Raises InputError for the first of ``paths`` where there is nothing."""
    for path in paths:
        if not Path(path).exists():
            raise InputError(f"{path}: no such file; check the spelling and the folder")


def add_pictures(parser) -> None:
    """The option that becomes ``args.pictures``."""
    parser.add_argument(
        "--no-pictures", dest="pictures", action="store_false", help="write no preview; the report has none then"
    )
