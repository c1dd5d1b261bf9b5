# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake or a relight tells: to whom on the way, and what it produced."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field as default
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..core.conventions import MOST_REACH_M
from ..core.errors import InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot

if TYPE_CHECKING:  # shards are merged where there is no Blender
    from ..gpu_shaders.scene_textures import SceneTextures


class Reporter(Protocol):
    """Where a bake tells how far it is."""

    def phase(self, name: str, total: int | None = None) -> None: ...

    def advance(self, amount: int = 1) -> None: ...

    def note(self, text: str) -> None: ...

    def warn(self, text: str) -> None: ...


class Silent:
    """A reporter for bakes that nobody waits for."""

    def phase(self, name: str, total: int | None = None) -> None:
        pass

    def advance(self, amount: int = 1) -> None:
        pass

    def note(self, text: str) -> None:
        pass

    def warn(self, text: str) -> None:
        pass


@dataclass
class Relit:
    """What a relight did, in numbers; everything else was kept."""

    changes: list[str] = default(default_factory=list)  # in plain words
    probes: int = 0  # that capture
    probes_captured: int = 0  # of them again; one that moved twice counts twice
    patches: int = 0  # of surface
    patches_lit: int = 0  # whose direct light was computed
    lights_direct: int = 0  # lamps whose direct light was computed
    patches_traced: int = 0  # whose rays to others were traced
    hierarchy: str = "kept"  # kept | refit | rebuilt
    kept_places: bool = True  # probes and patches are where they were: only their light is new
    warm_start: bool = False  # bounces went on from the light before
    iterations: int = 0


@dataclass
class BakeResult:
    """What a bake produced. ``seconds`` by phase; ``energy`` per iteration: mean luminance of the irradiance of patches
    that probes see. ``relit`` only after a relight."""

    field: Field | None = None
    iterations: int = 0
    converged: bool = False
    missing: float = 0.0  # estimated share of the light still to come when iterations stopped
    energy: list[float] = default(default_factory=list)
    change: list[float] = default(default_factory=list)
    seconds: dict[str, float] = default(default_factory=dict)
    counts: dict[str, int] = default(default_factory=dict)
    capture: str = ""
    scene: SceneTextures | None = None  # for pictures: the scene as it lies on the GPU
    notes: list[str] = default(default_factory=list)
    warnings: list[str] = default(default_factory=list)
    relit: Relit | None = None
    settings: BakeSettings | None = None  # that the bake chose by itself, where it was given an error
    error: dict | None = None  # then: target, predicted error and its parts, see error_driven.py


def check_surfaces(snapshot: SceneSnapshot) -> None:
    """Raises InputError for a scene without surface, or with one beyond what 32 bits can square."""
    if not len(snapshot.triangles):
        raise InputError(f"scene '{snapshot.name}' has no surface that renders; add a mesh or enable one for rendering")
    if max(-float(snapshot.vertices.min()), float(snapshot.vertices.max())) > MOST_REACH_M:
        beyond = (abs(snapshot.vertices) > MOST_REACH_M).any(axis=1)
        triangle = int(np.argmax(beyond[snapshot.triangles].any(axis=1)))
        name = snapshot.object_names[int(snapshot.object_index[triangle])]
        raise InputError(f"object '{name}' reaches farther than {MOST_REACH_M:g} m; bring it nearer or scale it down")


def check_scene(snapshot: SceneSnapshot, result: BakeResult) -> None:
    """Refuses scenes without surface, warns of those without light."""
    check_surfaces(snapshot)
    emits = any(any(m.emission) for m in snapshot.materials)
    world = snapshot.world.map is not None or any(snapshot.world.color)
    if not (snapshot.lights or emits or world):
        result.warnings.append(
            f"scene '{snapshot.name}' has no light: no lamp, emission or world; the field is black. Add a light or "
            "enable its rendering"
        )


def is_unsettled(result: BakeResult, settings: BakeSettings) -> bool:
    """Did the light fail to settle where it should have? A number of bounces that was asked for is no failure."""
    return settings.bounces is None and not result.converged


def report_on(result: BakeResult, grid: Grid, settings: BakeSettings, reporter: Reporter) -> bool:
    """Passes on what a bake or relight had to say; returns whether its light settled where it should have."""
    for warning in result.warnings:
        reporter.warn(warning)
    for note in result.notes:
        reporter.note(note)
    if is_unsettled(result, settings):
        reporter.warn(
            f"{grid.name}: the light has not settled after {result.iterations} iterations; the files are "
            "written and marked. Raise the tolerance (--tolerance), or darken materials that reflect all light"
        )
        return False
    return True
