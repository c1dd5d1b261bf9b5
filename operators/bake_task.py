# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake of one or more volumes in steps: what ``Bake`` drives to the end at once, or with a timer bit by bit.

Until the last step nothing in the file changes, so giving up at any time leaves everything as it was. Blender's data
may change between two steps: the task keeps arrays of its own and knows volumes by their session's identifier only.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator

import bpy

from ..bake.bake_job import BakeJob
from ..bake.result import BakeResult
from ..core.error_budget import ErrorGoal
from ..core.errors import Cancelled, InputError
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import STEP_SECONDS, Pace, Steps, together
from ..formats import probe_file
from ..formats.probe_metadata import part_hashes, provenance
from ..gpu_shaders.context import device_description, ensure_context
from ..scene.field_storage import store_field, stored_details, stored_metadata
from ..scene.probe_objects import read_edits
from ..scene.read import read_in_steps
from . import kept_bakes
from .animated import animated_states, evaluate_animation, taken_back
from .bake_progress import Progress
from .kept_bakes import KeptBake
from .stale import edit_count
from .volume_choice import grid_of


class BakeTask:
    """Call ``next(task)`` until it stops; ``outcome`` then says in one line what came of it.

    ``next`` raises what goes wrong: a GridlightError, after which the task is over.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        view_layer: bpy.types.ViewLayer,
        volumes: list[bpy.types.Object],
        relight: bool = False,
    ):
        """``relight``: go on from bakes that were kept, where they fit; others are baked from nothing."""
        self._relight = relight
        self.settings: BakeSettings = scene.gridlight.bake_settings()
        self._goal: ErrorGoal | None = scene.gridlight.error_goal()
        self.progress = Progress(len(volumes), self.settings)
        self.outcome = ""
        self.longest_steps: dict[str, float] = {}  # seconds, by the phase in which the step began
        self._scene = scene.session_uid
        self._view_layer = view_layer.name
        self._volumes = [volume.session_uid for volume in volumes]
        self._stop_reason = ""
        self._pace = Pace(STEP_SECONDS)  # of what is computed beside the bakes
        self._steps = self._run()

    def __next__(self) -> None:
        if self._stop_reason:
            self.close()
            raise Cancelled(self._stop_reason)
        phase, started = self.progress.phase_name, time.perf_counter()
        try:
            next(self._steps)
        finally:
            seconds = time.perf_counter() - started
            self.longest_steps[phase] = max(self.longest_steps.get(phase, 0.0), seconds)

    def __iter__(self) -> BakeTask:
        return self

    def stop(self, reason: str) -> None:
        """Makes the next step the last. ``reason`` is a line for the user."""
        self._stop_reason = self._stop_reason or reason

    def close(self) -> None:
        """Lets go of everything on the GPU. Whoever keeps the task itself keeps little."""
        self._steps.close()

    @property
    def stopped(self) -> bool:
        return bool(self._stop_reason)

    def check(self) -> None:
        """Stops the task if what it works for is gone."""
        try:
            self._find_volumes()
        except InputError as error:
            self.stop(f"The bake was given up: {error}")

    def _run(self) -> Iterator[None]:
        started = time.perf_counter()
        self.progress.phase("read")
        yield  # the first picture of the progress comes before the first work
        ensure_context()
        scene = self._find_scene()
        quality = scene.gridlight.quality
        put_by_hand = animated_states(scene)
        view_layer: bpy.types.ViewLayer = scene.view_layers.get(self._view_layer)
        try:
            snapshot, shown_now = yield from self._read(scene, view_layer)
        except RuntimeError as error:  # Blender could not evaluate the scene at render quality now
            raise InputError(
                f"the scene cannot be read: {error}; wait until Blender renders no more, then bake again"
            ) from error
        # Not before: reading evaluates the scene, and a volume that is animated then stands where the frame has it.
        scene, volumes = self._find_scene(), self._find_volumes()
        grids = [grid_of(volume) for volume in volumes]
        edits = [read_edits(scene, volume) for volume in volumes]
        for grid in grids:
            probe_file.check_size(grid, self.settings.bands)
        noticed = [*snapshot.warnings, *taken_back(scene, put_by_hand)]
        shown = (yield from self._pace.in_background(part_hashes, shown_now)) if shown_now else {}
        for warning in noticed:
            self.progress.warn(warning)
        yield
        bakes: list[KeptBake] = []
        for uid, grid, edit in zip(self._volumes, grids, edits):
            self.progress.volume(grid.name)
            bakes.append((yield from self._bake(uid, snapshot, grid, edit)))
        results = [bake.session.result for bake in bakes]
        self.outcome = _in_words(results, time.perf_counter() - started)
        device = device_description()
        metadata = []
        before = [(stored_metadata(volume) or {}).get("iterations", 0) for volume in self._find_volumes()]
        for result, iterations_before in zip(results, before):
            warnings = [*self.progress.warnings, *result.warnings]
            iterations = result.iterations or iterations_before  # a relight that found nothing to do leaves them
            told = snapshot, result.settings or self.settings, device, iterations, result.converged, warnings
            metadata.append((yield from self._pace.in_background(provenance, *told)))
            if result.error:
                metadata[-1]["error"] = result.error
        for volume, result, about in zip(self._find_volumes(), results, metadata):
            self._store(volume, result, about, shown, quality)
        kept_bakes.keep(dict(zip(self._volumes, bakes)))

    def _read(
        self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer
    ) -> Steps[tuple[SceneSnapshot, SceneSnapshot | None]]:
        """The scene as it is rendered, and as it is shown, which says later whether it is still the one that was
        baked. None for that where somebody edited it in between."""
        evaluate_animation(scene)
        reading = together(read_in_steps(scene, view_layer, live=True), read_in_steps(scene, view_layer))
        next(reading)  # what is shown; the next step evaluates what is rendered, which itself looks like an edit
        edits = edit_count(self._scene)
        yield
        is_edited = edit_count(self._scene) != edits
        shown, snapshot = yield from reading
        return snapshot, None if is_edited else shown

    def _bake(
        self, uid: int, snapshot: SceneSnapshot, grid: Grid, edits: ProbeEdits | None
    ) -> Generator[None, None, KeptBake]:
        """One volume; returns its bake."""
        kept = kept_bakes.take(uid)  # a bake from nothing wants the memory of the one before
        if self._relight and self._goal is None and kept is not None and kept.fits(grid, self.settings, edits):
            kept.relay.target = self.progress
            yield from kept.session.relight(snapshot)
            return kept
        shown = kept.session.result.scene if kept else None  # the next one shares its images
        del kept
        fresh = KeptBake(BakeJob(snapshot, grid, self.settings, edits), self.progress, self._goal)
        yield from fresh.bake()
        del shown
        return fresh

    def _find_scene(self) -> bpy.types.Scene:
        """The scene as it is now.

        Raises:
            InputError: it was deleted.
        """
        scene = _by_uid(bpy.data.scenes, self._scene)
        if scene is None:
            raise InputError("the scene was deleted while it was baked; open another one and bake that")
        return scene

    def _find_volumes(self) -> list[bpy.types.Object]:
        """The volumes as they are now; undo and renaming may have moved them.

        Raises:
            InputError: one was deleted.
        """
        scene = _by_uid(bpy.data.scenes, self._scene)
        volumes = [_by_uid(scene.objects, uid) for uid in self._volumes] if scene else [None]
        if None in volumes:
            raise InputError(
                "the volume or its scene was deleted while it was baked; choose another volume and bake that"
            )
        return volumes

    def _store(
        self, volume: bpy.types.Object, result: BakeResult, metadata: dict, shown: dict[str, str], quality: str
    ) -> None:
        result.field.metadata = {**result.field.metadata, **metadata}
        details = {
            "outcome": self.outcome,
            "bounces": _bounces(result) if result.iterations else stored_details(volume).get("bounces", 0),
            "viewport_hashes": shown,
            "seconds": result.seconds,
            "longest_steps": self.longest_steps,
            "energy": [float(value) for value in result.energy],
            "change": [float(value) for value in result.change],
            "notes": result.notes,
            "quality": quality,
        }
        store_field(volume, result.field, metadata["scene_hash"], details)


def _by_uid(items, uid: int):
    return next((item for item in items if item.session_uid == uid), None)


def _in_words(results: list[BakeResult], seconds: float) -> str:
    active = sum(result.counts["active"] for result in results)
    bounces = max(_bounces(result) for result in results)
    if all(result.relit and not result.iterations for result in results):
        return f"Nothing had changed: {active} probes keep their light"
    done = "relit" if all(result.relit for result in results) else "baked"
    often = {0: "did not bounce", 1: "bounced once", 2: "bounced twice"}.get(bounces, f"bounced {bounces} times")
    text = f"{active} probes {done} in {seconds:.1f} s, light {often}"
    predicted = [result.error["predicted"] for result in results if result.error]
    if predicted and None not in predicted:
        text += f", {100 * max(predicted):.1f} % error at probes by its own estimate"
    if not all(result.converged for result in results):
        text += ", some of it is still missing"
    return text


def _bounces(result: BakeResult) -> int:
    """The first iteration takes direct light to patches, unless bounces went on from the light before."""
    goes_on = result.relit is not None and result.relit.warm_start
    return max(result.iterations - (0 if goes_on else 1), 0)
