# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a field came from: the part of a probe file's JSON that the field itself cannot say."""

from __future__ import annotations

import dataclasses
import hashlib
import tomllib
from pathlib import Path

import numpy as np

from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot

# Of a snapshot, what light transport does not see.
_NOT_HASHED = {"volumes", "camera", "exposure", "name", "warnings", "object_names", "frame"}
LIGHTS, WORLD, SURFACES = "lights", "world", "surfaces"  # parts of a scene
_PART_OF_FIELD = {"lights": LIGHTS, "world": WORLD}  # the rest are surfaces


def program_version() -> str:
    """Gridlight's version, as the manifest states it."""
    manifest = Path(__file__).resolve().parent.parent / "blender_manifest.toml"
    return tomllib.loads(manifest.read_text(encoding="utf-8"))["version"]


def scene_hash(snapshot: SceneSnapshot) -> str:
    """SHA-256 of everything in ``snapshot`` that light depends on; equal scenes in equal order give equal text."""
    digest = hashlib.sha256()
    for item in dataclasses.fields(snapshot):
        if item.name not in _NOT_HASHED:
            digest.update(item.name.encode())
            _update(digest, getattr(snapshot, item.name))
    return digest.hexdigest()


def part_hashes(snapshot: SceneSnapshot) -> dict[str, str]:
    """As ``scene_hash``, of lights, world and surfaces by themselves: tells what differs between two states."""
    digests = {part: hashlib.sha256() for part in (LIGHTS, WORLD, SURFACES)}
    for item in dataclasses.fields(snapshot):
        if item.name not in _NOT_HASHED:
            digest = digests[_PART_OF_FIELD.get(item.name, SURFACES)]
            digest.update(item.name.encode())
            _update(digest, getattr(snapshot, item.name))
    return {part: digest.hexdigest() for part, digest in digests.items()}


def _update(digest, value) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value))
    elif dataclasses.is_dataclass(value):
        for item in dataclasses.fields(value):
            digest.update(item.name.encode())
            _update(digest, getattr(value, item.name))
    elif isinstance(value, np.generic):
        _update(digest, value.item())
    elif isinstance(value, (list, tuple)):
        digest.update(f"[{len(value)}".encode())
        for element in value:
            _update(digest, element)
    else:
        digest.update(repr(value).encode())


def provenance(
    snapshot: SceneSnapshot, settings: BakeSettings, device: str, iterations: int, converged: bool, warnings: list[str]
) -> dict:
    """The metadata of a baked field. Holds no times, so that equal bakes give equal bytes."""
    return stated(
        snapshot.name, snapshot.frame, scene_hash(snapshot), settings, device, iterations, converged, warnings
    )


def stated(
    scene_name: str,
    frame: int,
    scene_digest: str,
    settings: BakeSettings,
    device: str,
    iterations: int,
    converged: bool,
    warnings: list[str],
) -> dict:
    """The same where the scene itself is elsewhere."""
    return {
        "generator": f"Gridlight {program_version()}",
        "scene": {"name": scene_name, "frame": frame},
        "scene_hash": scene_digest,
        "settings": settings.as_dict(),
        "device": device,
        "iterations": iterations,
        "converged": converged,
        "warnings": warnings,
    }
