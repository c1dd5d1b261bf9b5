# SPDX-License-Identifier: GPL-3.0-or-later
"""Warnings of one read: each said once, and one line for many things with the same trouble."""

from __future__ import annotations

_NAMES_SHOWN = 6


class Notices:
    """Collects warnings in the order in which they first came up."""

    def __init__(self):
        self._names: dict[str, dict[str, None]] = {}  # reason -> names, both in order of arrival

    def append(self, text: str) -> None:
        """A warning that names its thing itself."""
        self._names.setdefault(text, {})

    def group(self, reason: str, name: str) -> None:
        """A warning that many things may share; they are listed behind it."""
        self._names.setdefault(reason, {})[name] = None

    def extend(self, other: Notices) -> None:
        """All that ``other`` collected."""
        for reason, names in other._names.items():
            self._names.setdefault(reason, {}).update(names)

    def lines(self) -> list[str]:
        result = []
        for reason, names in self._names.items():
            shown = [f"'{name}'" for name in list(names)[:_NAMES_SHOWN]]
            if len(names) > _NAMES_SHOWN:
                shown.append(f"and {len(names) - _NAMES_SHOWN} more")
            result.append(f"{reason}: {', '.join(shown)}" if names else reason)
        return result
