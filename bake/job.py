# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake from a scene snapshot to a field.

``bake_steps`` is the whole job as a generator that yields between pieces of GPU work: ``run_bake`` drives it to the
end, a timer can drive it step by step. Cancelling is not calling ``next`` again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from dataclasses import field as default
from typing import Protocol

import numpy as np

from ..core import culling, dilation, relocation
from ..core.conventions import ACTIVE, CULLED, INVALID
from ..core.errors import Cancelled, InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.orientation import ShellVote, inside_solid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..gpu_shaders.backend import GpuBackend, Surfaces
from ..gpu_shaders.scene_textures import SceneTextures
from .capture_choice import choose_capture
from .convergence import Convergence
from .deringing import dering_field


class Reporter(Protocol):
    """Where a bake tells how far it is."""

    def phase(self, name: str, total: int | None = None) -> None: ...

    def advance(self, amount: int = 1) -> None: ...

    def note(self, text: str) -> None: ...

    def warn(self, text: str) -> None: ...


@dataclass
class BakeResult:
    """What a bake produced. ``seconds`` by phase; ``energy`` per iteration: mean luminance of band 0 over active
    probes."""

    field: Field | None = None
    iterations: int = 0
    converged: bool = False
    energy: list[float] = default(default_factory=list)
    change: list[float] = default(default_factory=list)
    seconds: dict[str, float] = default(default_factory=dict)
    counts: dict[str, int] = default(default_factory=dict)
    capture: str = ""
    scene: SceneTextures | None = None  # for pictures: the scene as it lies on the GPU
    notes: list[str] = default(default_factory=list)
    warnings: list[str] = default(default_factory=list)


def run_bake(
    snapshot: SceneSnapshot,
    grid: Grid,
    settings: BakeSettings,
    reporter: Reporter,
    should_stop: Callable[[], bool],
    edits: ProbeEdits | None = None,
) -> BakeResult:
    """Bakes ``snapshot`` into ``grid``, as ``bake_steps`` says. Needs a GPU context.

    Raises:
        InputError: the scene has no surface, or the grid does not fit the GPU.
        Cancelled: ``should_stop`` returned true between two steps.
    """
    result = BakeResult()
    for _ in bake_steps(snapshot, grid, settings, reporter, result, edits):
        if should_stop():
            raise Cancelled("cancelled; nothing was written")
    return result


def bake_steps(
    snapshot: SceneSnapshot,
    grid: Grid,
    settings: BakeSettings,
    reporter: Reporter,
    result: BakeResult,
    edits: ProbeEdits | None = None,
) -> Iterator[None]:
    """The bake in steps; fills ``result`` as it goes and completes it with the last step.

    ``edits``: probes that the user switched off or moved. Moved ones capture where they were put and are not relocated.
    """
    edits = edits or ProbeEdits.none(grid)
    if not len(snapshot.triangles):
        raise InputError(f"scene '{snapshot.name}' has no surface that renders; add or unhide a mesh")
    _warn_about_light(snapshot, result)

    with _timed(result, "cull"):
        reporter.phase("cull")
        state = _cull(snapshot, grid, settings, result)
        state[edits.disabled] = CULLED
        if edits.disabled.any() and not (state == ACTIVE).any():
            raise InputError(
                f"{grid.name}: every probe is switched off; bring some back with Reset"
            )
    yield

    with _timed(result, "setup"):
        reporter.phase("upload")
        backend = GpuBackend(snapshot, grid, settings)
        result.scene = backend.scene
        nodes = np.flatnonzero(state == ACTIVE)
        positions = (grid.positions() + edits.offset)[nodes]
    yield
    with _timed(result, "capture"):
        result.capture, reason = choose_capture(settings, backend.scene.triangle_count)
        result.notes.append(reason)
        backend.set_probes(nodes, positions)
        backend.allocate_field()
    yield

    batches = _Batches(backend, len(nodes), result.capture, result)
    if not batches.resident:
        result.notes.append(
            f"texel surfaces of {len(nodes)} probes exceed the memory budget of {settings.memory_mib} MiB: "
            "they are captured again in every iteration"
        )
    reporter.phase("capture", len(nodes))
    for index in range(batches.count):
        surfaces = batches.captured(index)
        reporter.advance(surfaces.count)
        yield
    with _timed(result, "light"):
        backend.light.light_new_patches()
    vote = ShellVote(backend.object_count)
    for index in range(batches.count):
        vote.add(backend.sightings(batches.captured(index)))
        yield
    backend.set_shells(vote.shells())
    yield from _each_statistics(batches, backend)
    shares = backend.read_shares()
    offset = edits.offset.astype(np.float32)
    moved = yield from _relocate(batches, backend, grid, nodes, shares, offset)
    if moved:
        result.notes.append(f"{moved} probes in or behind walls were moved out, at most half a cell")
        shares = backend.read_shares()
    inside = inside_solid(shares)
    if inside.all():
        result.warnings.append(
            f"{grid.name}: every probe sees mostly back faces without light; they are baked all the same. Flip the "
            "normals of what surrounds the volume, or move it out of solid geometry"
        )
    else:
        state[nodes[inside]] = INVALID

    reporter.phase("light")
    with _timed(result, "light"):
        backend.light.connect()
    result.notes.append(f"light bounces between {backend.light.count} patches of surface")
    yield
    convergence = Convergence(settings.bounces, settings.tolerance)
    while not convergence.done:
        with _timed(result, "light"):
            energy, change, overlap, luminance = backend.light.iterate(bounce=convergence.iterations > 0)
            result.energy.append(luminance)
            factor = convergence.add(energy, change, overlap)
            reporter.advance(1)
            if factor:
                backend.light.extrapolate(factor)
        yield
    if backend.scene.emitter_count:
        for index in range(batches.count):
            with _timed(result, "light"):
                backend.find_emission(batches.captured(index))
            yield
    reporter.phase("gather" if settings.gather else "project", len(nodes))
    for index in range(batches.count):
        surfaces = batches.captured(index)
        with _timed(result, "light"):
            (backend.gather if settings.gather else backend.project)(surfaces)
            reporter.advance(surfaces.count)
        yield

    with _timed(result, "light"):
        result.iterations = convergence.iterations
        result.converged = convergence.converged
        result.change = convergence.changes
        result.notes.append(convergence.reason)
        result.field = _finish(backend, grid, settings, state, nodes, shares, offset)
        if settings.deringing:
            result.notes.append(dering_field(result.field))
    result.counts = {
        "total": grid.count,
        "active": int((state == ACTIVE).sum()),
        "culled": int((state == CULLED).sum()),
        "invalid": int((state == INVALID).sum()),
    }
    if not np.isfinite(result.field.coefficients).all():
        raise InputError(
            f"scene '{snapshot.name}' sends light that is not finite; look for lights or emission beyond 1e30"
        )


class _Batches:
    """Texel surfaces of all active probes in batches, kept while they fit the budget and captured again where not."""

    def __init__(self, backend: GpuBackend, slots: int, method: str, result: BakeResult):
        self._backend = backend
        self._method = method
        self._slots = slots
        self.result = result
        self.resident = slots <= backend.probes_in_budget
        self._size = min(backend.probes_per_batch, slots)
        self.count = -(-slots // self._size)
        self._kept: dict[int, Surfaces] = {}

    def range(self, index: int) -> tuple[int, int]:
        """First slot and number of slots of batch ``index``."""
        first = index * self._size
        return first, min(self._size, self._slots - first)

    def slots_of(self, index: int, slots: np.ndarray) -> np.ndarray:
        """Those of ``slots`` that are in batch ``index``."""
        first, count = self.range(index)
        return slots[(slots >= first) & (slots < first + count)]

    def captured(self, index: int) -> Surfaces:
        """Batch ``index`` with geometry, albedo, emission and the patches that texels lie on."""
        if index in self._kept:
            return self._kept[index]
        if not self.resident:
            self._kept.clear()  # frees the images of the batch before
        with _timed(self.result, "capture"):
            surfaces = self._kept[index] = self._backend.surfaces(*self.range(index))
            self._backend.capture(surfaces, self._method)
        with _timed(self.result, "light"):
            self._backend.bind(surfaces)
        return surfaces

    def capture_again(self, index: int, slots: np.ndarray) -> Surfaces:
        """Batch ``index`` after the probes in ``slots`` (L,), ascending and in this batch, have moved."""
        surfaces = self.captured(index)
        layers = slots - surfaces.first
        for run in np.split(layers, np.flatnonzero(np.diff(layers) > 1) + 1):
            with _timed(self.result, "capture"):
                self._backend.capture(surfaces, self._method, int(run[0]), len(run))
            with _timed(self.result, "light"):
                self._backend.bind(surfaces, int(run[0]), len(run))
        return surfaces


def _each_statistics(batches: _Batches, backend: GpuBackend) -> Iterator[None]:
    for index in range(batches.count):
        backend.statistics(batches.captured(index))
        yield


def _relocate(
    batches: _Batches, backend: GpuBackend, grid: Grid, nodes: np.ndarray, shares: np.ndarray, offset: np.ndarray
) -> Iterator[None]:
    """Moves probes that stand in or behind walls, fills ``offset`` (P, 3) in metres and returns how many moved.

    A probe that sees no light from its new place either goes back.
    """
    moved_by_hand = offset[nodes].any(axis=1)
    candidates = np.flatnonzero(relocation.misplaced(shares) & ~moved_by_hand)
    if not len(candidates):
        return 0
    home = grid.positions()[nodes] + offset[nodes]
    step = np.zeros((len(nodes), 3))
    for index in range(batches.count):
        surfaces = batches.captured(index)
        slots = batches.slots_of(index, candidates)
        if len(slots):
            step[slots] = relocation.moves(grid, home[slots], backend.exits(surfaces, slots - surfaces.first))
        yield
    moved = np.flatnonzero(step.any(axis=1))
    for changed in (moved, None):
        if changed is None:  # second round: what saw no light goes home
            shares = backend.read_shares()[moved]
            changed = moved[(shares[:, 2] == 0) | inside_solid(shares)]
            step[changed] = 0.0
        backend.set_probes(nodes, home + step)
        for index in range(batches.count):
            slots = batches.slots_of(index, changed)
            if len(slots):
                batches.capture_again(index, slots)
            yield
        with _timed(batches.result, "light"):
            backend.light.light_new_patches()
        for index in range(batches.count):
            if len(batches.slots_of(index, changed)):
                backend.statistics(batches.captured(index))
            yield
    offset[nodes] += step
    return int(step.any(axis=1).sum())


def _cull(snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, result: BakeResult) -> np.ndarray:
    """(P,) uint8 states before capture: ACTIVE or CULLED."""
    if settings.keep_all:
        return np.full(grid.count, ACTIVE, np.uint8)
    needed = culling.needed_nodes(grid, snapshot.triangle_positions)
    return np.where(needed, ACTIVE, CULLED).astype(np.uint8)


def _finish(
    backend: GpuBackend,
    grid: Grid,
    settings: BakeSettings,
    state: np.ndarray,
    nodes: np.ndarray,
    shares: np.ndarray,
    offset: np.ndarray,
) -> Field:
    """Reads the field back and completes it for probes without light of their own."""
    baked = Field.empty(grid, settings.bands)
    baked.state[:] = state
    baked.validity[nodes] = 1.0 - shares[:, 0]
    baked.offset[:] = offset
    baked.coefficients[nodes] = backend.read_field()
    baked.coefficients = dilation.fill(grid, baked.coefficients, state == ACTIVE)
    baked.depth[nodes] = backend.read_depth()
    return baked


def _warn_about_light(snapshot: SceneSnapshot, result: BakeResult) -> None:
    emits = any(max(m.emission) > 0 for m in snapshot.materials)
    world = snapshot.world.map is not None or max(snapshot.world.color) > 0
    if not (snapshot.lights or emits or world):
        result.warnings.append(
            f"scene '{snapshot.name}' has no light: no lamp, emission or world; the field is black. Add a light or "
            "enable its rendering"
        )


@contextmanager
def _timed(result: BakeResult, phase: str):
    """Adds the time of a step to its phase. GPU work is counted where the program waits for it."""
    start = time.perf_counter()
    yield
    result.seconds[phase] = result.seconds.get(phase, 0.0) + time.perf_counter() - start
