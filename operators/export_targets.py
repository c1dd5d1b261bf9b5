# SPDX-License-Identifier: GPL-3.0-or-later
"""The export formats as the interface offers them."""

from __future__ import annotations

from ..formats.export import TARGETS

PROBE_FILE = "exr"
_TITLES = {
    "three": "three.js",
    "godot": "Godot",
    "unity": "Unity",
    "bevy": "Bevy",
    "exr-flipbook": "EXR Flipbook",
    "json": "JSON",
    "cubemap": "Cubemap of One Probe",
    "three-light": "three.js, One Light Probe",
    "filament": "Filament, One Probe",
}

TARGET_ITEMS = [
    (PROBE_FILE, "Probe File", "OpenEXR with everything that was baked; what Gridlight's command line reads"),
    *((name, _TITLES.get(name, name), f"Read by: {module.ENGINE}") for name, module in TARGETS.items()),
]


def does_not_carry(target: str) -> list[str]:
    """What is lost in a format, in plain words."""
    return [] if target == PROBE_FILE else list(TARGETS[target].DOES_NOT_CARRY)
