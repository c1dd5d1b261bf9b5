# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that is asked for an error at probes instead of settings.

    cheap bake ──► paths from some probes ──► error small enough? ──yes──► fewer bands where they say nothing ──► done
        ▲                (core/path_check.py)          │ no
        └── the cheapest level that should do ◄────────┘
            (core/error_budget.py): finer faces, or one more pass of samples, for the probes that need it

Paths share nothing with the bake but scene and lamps: what they tell is an error, not a guess of one. They are followed
until they decide. Passes with the same face are averaged, so no sample is wasted; a finer face begins anew for the
probes that need it. Scene textures and hierarchy stay on the GPU throughout, captures while the face does.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core import adaptive_bands, lookup
from ..core.conventions import ACTIVE
from ..core.error_budget import ErrorGoal, ErrorModel, Level, cost_of_paths, first_level, next_level, worst_probes
from ..core.field import Field
from ..core.path_check import MOST_BANDS, NORMALS, SquaredError, irradiance_of
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.steps import Pace, Steps
from ..gpu_shaders.scene_textures import SceneTextures
from .bake_job import BakeJob
from .block_session import AnySession, open_session
from .deringing import dering_field
from .followed_paths import FollowedPaths
from .passes import Passes
from .result import BakeResult, Reporter
from .session import BakeSession
from .stopwatch import Stopwatch

_CHECKED = 64  # probes from which paths are followed
_BETWEEN = 32  # places between probes
_FIRST_PATHS, _MOST_PATHS = 64, 1024  # of each place and set
_BLURRED = 0.3  # of the standard error: less is not the paths' doing, but the spread between probes
_SURE = 1.0  # standard errors by which a bake has to be below its target
_LOST = 2.0  # standard errors by which it is held to be above: few paths carry most light and may come too early
_LEAST_AIM, _MOST_AIM = 0.5, 0.7  # of the squared error that the target leaves: between these, levels aim below it
_NEAR_FLOOR = 0.6  # where the bands alone miss the target, the rest is brought below this share of what they lose
_GIVEN_UP = 0.25  # of the squared error that is left when the target is met: upper bands that may go
_TAIL = 0.2  # of the target: light that may be missing when iterations stop
_MOST_PASSES = 6
_MOST_CHECK = 2.0  # in first bakes: what paths may cost
_MOST_COST, _MOST_IN_VAIN = 4.0, 2.0  # in first bakes: what all may cost, and where bands leave settings no room
_MOST_STEP = 3.0  # times what was spent so far: what one more may cost
_SEED_STEP = 7919  # between passes
_BEHIND = 0.25  # of back faces in sight: more, and a place is inside something


class ErrorDrivenBake:
    """``bake`` once; ``result`` is then like that of a BakeSession, with ``settings`` and ``error``. ``session`` is
    that of the last pass over all probes; a relight of it does not look after the error. ``whole`` is the field before
    probes gave up upper bands."""

    def __init__(
        self,
        job: BakeJob,
        goal: ErrorGoal,
        reporter: Reporter,
        result: BakeResult | None = None,
        *,
        pace: Pace | None = None,
    ):
        """``job``: its settings say where to begin, and what ``goal`` does not decide."""
        self.snapshot, self.grid, self.goal = job.snapshot, job.grid, goal
        self._reporter = reporter
        self._pace = pace or Pace(None)
        self._edits = job.probe_edits
        settings = job.settings
        self._deringing = settings.deringing
        tolerance = settings.tolerance if "tolerance" in goal.kept else float(np.clip(_TAIL * goal.target, 1e-4, 2e-2))
        bands = settings.bands if "bands" in goal.kept else MOST_BANDS
        self._level = first_level(goal, settings.face, settings.samples)
        self._settings = replace(
            settings,
            bands=bands,
            face=self._level.face,
            samples=self._level.samples,
            tolerance=tolerance,
            deringing=False,
        )
        self.result = result or BakeResult()
        self._stopwatch = Stopwatch(self.result.seconds)
        self._passes: list[str] = []
        self._spent = 0.0
        self._between: SquaredError | None = None
        self.whole: Field | None = None
        self._scene: SceneTextures | None = None

    # The whole
    # ------------------------------------------------------------------------------------------------------------------

    def bake(self) -> Steps[None]:
        """The bake in steps; completes ``result`` with the last one.

        Raises:
            InputError: as BakeSession.bake does.
        """
        self.session: AnySession = self._open(self._settings, self._edits, self.result)
        yield from self.session.bake()
        self._scene = self.result.scene
        field = self._field = _baked(self.result)
        self._took(self._level, int((field.state == ACTIVE).sum()))
        self._active = np.flatnonzero(field.state == ACTIVE)
        self._light = Passes(field, self._level)
        settled = self.result.converged or self._settings.bounces is not None
        if not len(self._active) or not settled:
            self._finish(None, "the light has not settled, so its error was not estimated")
            return
        yield from self._find_level()

    def _open(self, settings: BakeSettings, edits: ProbeEdits, result: BakeResult | None = None) -> AnySession:
        """A session that uses the scene on the GPU, or one of several blocks, which sends it itself."""
        job = BakeJob(self.snapshot, self.grid, settings, edits)
        if self.grid.count > settings.block:
            return open_session(job, self._reporter, result, pace=self._pace)
        return BakeSession(job, self._reporter, result, pace=self._pace, scene=self._scene)

    def _find_level(self) -> Steps[None]:
        """Checks and refines until the target is met or nothing helps."""
        random = np.random.default_rng(self._settings.seed)
        self._checked = np.sort(random.permutation(self._active)[:_CHECKED])
        positions = (self.grid.positions() + self._field.offset)[self._checked]
        self._paths = self._paths_from(positions, drawn_from=len(self._active))
        self._check = self._paths.check
        self._model = ErrorModel()
        why = ""
        while True:
            yield from self._follow_paths()
            if not self._check.scale:
                self._finish(None, "no light reaches the probes, there is no error to relate to it")
                return
            error, own, wanted = self._error(), self._own_error(), self._wanted()
            floor = np.sqrt(self._floor())
            found = f"{100 * max(error.estimate, floor):.2g} % from paths at {len(self._checked)} probes"
            self._reporter.note(
                f"{self._passes[-1]}: {found} "
                f"(up to {100 * error.bound(_SURE):.2g} %), the bands alone {100 * floor:.2g} %"
            )
            if error.bound(_SURE) <= self.goal.target:
                break
            if own.value <= max(wanted, own.noise) and self._floor() > (_NEAR_FLOOR * self.goal.target) ** 2:
                why = "what the bands cannot say"
                break
            if not self._decided() and own.value <= _LOST * own.noise:
                why = "what paths can tell"
                break
            level = self._next(wanted)
            if level is None or len(self._passes) > _MOST_PASSES:
                why = "the limit of passes" if level is not None else "no setting that helps"
                break
            yield from self._refine(level, wanted)
        yield from self._look_between(random)
        self._finish(error, why)

    def _wanted(self) -> float:
        """Squared error within the bands to aim for: below what the target leaves beside the bands' floor, by what
        paths cannot tell."""
        floor = self._floor()
        left = self.goal.target**2 - floor
        aim = np.clip(left - _SURE * self._error().deviation, _LEAST_AIM * left, _MOST_AIM * left)
        return max(float(aim), _NEAR_FLOOR**2 * floor, 1e-8)

    def _floor(self) -> float:
        """Squared error that the bands alone make."""
        return max(self._check.floor(self._settings.bands).value, 0.0)

    def _own_error(self) -> SquaredError:
        """Squared error within the bands of all that was baked, which the model is told."""
        own = self._check.error_in_bands(self._light.mean[self._checked])
        self._model.set(self._level, max(own.value, own.noise))
        return own

    def _next(self, wanted: float) -> Level | None:
        """The level to go to, by what the model knows."""
        room = max(1.0 - self._floor() / self.goal.target**2, 0.0)  # all that settings can be better by
        all_of_it = (_MOST_IN_VAIN + (_MOST_COST - _MOST_IN_VAIN) * room) * self._cost_of_first()
        most = min(all_of_it - self._spent, _MOST_STEP * self._spent)
        return next_level(self._model, self._level, wanted, self.goal.kept, len(self._active), most)

    def _cost_of_first(self) -> float:
        level = first_level(self.goal, self._settings.face, self._settings.samples)
        return level.cost(len(self._active))

    def _error(self, field: Field | None = None) -> SquaredError:
        """Of what the probes of ``field`` hold, by default of all that was baked."""
        field = field or self._light.field
        return self._check.error(irradiance_of(field.coefficients[self._checked], NORMALS))

    def _follow_paths(self) -> Steps[None]:
        """More paths, twice as many each time, until they tell which side of the target the error lies on, or a finer
        bake that would be farther below it is cheaper than as many again."""
        self._reporter.phase("error")
        while True:
            if self._check.paths and (self._decided() or self._too_dear() or self._finer_is_cheaper()):
                return
            yield from self._paths.follow(max(self._check.paths, _FIRST_PATHS))

    def _decided(self) -> bool:
        """Whether the error is known to be on one side of the target, or as well as paths can tell."""
        error, target = self._error(), self.goal.target**2
        is_met, is_lost = error.bound(_SURE) ** 2 <= target, error.value - _LOST * error.deviation > target
        return is_met or is_lost or error.noise <= _BLURRED * error.deviation

    def _too_dear(self) -> bool:
        """Whether twice the paths would be too many."""
        too_many = 2 * self._check.paths > _MOST_PATHS
        return too_many or cost_of_paths(2 * self._paths.count) > _MOST_CHECK * self._cost_of_first()

    def _finer_is_cheaper(self) -> bool:
        """Than to double the paths."""
        self._own_error()
        wanted = self._wanted()
        level = self._next(wanted)
        if level is None or self._model.predicted(level) > wanted:
            return False
        pay = level.beyond(self._level).cost(len(self._active))
        return pay < cost_of_paths(self._paths.count)

    def _paths_from(self, places: np.ndarray, drawn_from: int | None = None) -> FollowedPaths:
        """Paths from ``places`` (K, 3), world metres."""
        assert self._scene is not None  # it is there after the first pass
        what = self._scene, self.snapshot, self.grid, places, self._settings, self._stopwatch, self._pace
        return FollowedPaths(*what, drawn_from)

    # Refining
    # ------------------------------------------------------------------------------------------------------------------

    def _refine(self, level: Level, wanted: float) -> Steps[None]:
        """Brings all probes, or those that need it, from the level they have to ``level``."""
        before = self._level
        samples = level.beyond(before).samples
        settings = replace(
            self._settings,
            face=level.face,
            samples=samples,
            seed=(self._settings.seed + _SEED_STEP * len(self._passes)) & 0x7FFFFFFF,
        )
        chosen = self._who_needs_it(self._model.predicted(level) / self._model.predicted(before), wanted)
        everyone = len(chosen) == len(self._active)
        session: AnySession
        kept = self.session
        if everyone and isinstance(kept, BakeSession) and kept.settings.face == level.face:
            session, steps = kept, kept.light_with(settings)
        else:
            session = self._open(settings, self._only(chosen))
            steps = session.bake()
        yield from steps
        for phase, seconds in session.result.seconds.items():
            if session.result is not self.result:
                self.result.seconds[phase] = self.result.seconds.get(phase, 0.0) + seconds
        if everyone:
            self.session = session
        self._light.add(_baked(session.result), chosen, Level(level.face, samples))
        self._took(Level(level.face, samples), len(chosen))
        self._level = level

    def _who_needs_it(self, gain: float, wanted: float) -> np.ndarray:
        """Nodes of the probes to refine: those that two estimates differ about most, if two are there."""
        spread = self._light.spread[self._active]
        if not spread.any():
            return self._active
        own = self._model.squared[-1]
        return self._active[worst_probes(spread * (own / spread.mean()), gain, wanted)]

    def _only(self, chosen: np.ndarray) -> ProbeEdits:
        """Edits that leave ``chosen`` nodes where the first pass put them and switch all others off."""
        disabled = np.ones(self.grid.count, bool)
        disabled[chosen] = False
        return ProbeEdits(disabled, np.asarray(self._field.offset, float))

    def _took(self, level: Level, probes: int) -> None:
        self._spent += level.cost(probes)
        self._passes.append(f"face {level.face}, samples {level.samples}, {probes} probes")

    # Between probes
    # ------------------------------------------------------------------------------------------------------------------

    def _look_between(self, random: np.random.Generator) -> Steps[None]:
        """The error at random free places of the volume, which the target does not cover."""
        local = random.uniform(-1, 1, (4 * _BETWEEN, 3))
        points = local @ self.grid.matrix[:3, :3].T + self.grid.matrix[:3, 3]
        behind = yield from self._paths_from(points).follow(2)
        points = points[behind <= _BEHIND][:_BETWEEN]
        if len(points):
            paths = self._paths_from(points)
            yield from paths.follow(_FIRST_PATHS // 2)
            if paths.check.scale:
                self._between = paths.check.error(_read(self._light.field, points))

    # The end
    # ------------------------------------------------------------------------------------------------------------------

    def _finish(self, error: SquaredError | None, why: str) -> None:
        """Chooses bands, puts the field together and says what came of it."""
        result, target = self.result, self.goal.target
        if len(self._passes) > 1:
            result.notes[:] = [note for note in result.notes if not note.startswith("light bounces")]
        result.notes.append("error-driven: " + "; ".join(self._passes))
        if error is None:
            result.field = self._light.field
            result.warnings.append(f"{self.grid.name}: an error of {100 * target:g} % was asked for: {why}")
            result.error = {"target": target, "predicted": None, "met": None, "reason": why}
        else:
            bands = self._fewest_bands(error)
            result.field = self._light.field_of(self._light.mean[:, : bands**2])
            self.whole = replace(result.field)
            kept = self._adapt_bands(result.field)
            result.error = {**self._said(result.field, why), "bands": kept}
        self.session.result = result  # what a relight goes on from
        level = self._level
        self._settings = replace(
            self._settings,
            face=level.face,
            samples=level.samples,
            bands=_baked(result).bands,
            deringing=self._deringing,
        )
        if self._deringing:
            result.notes.append(dering_field(_baked(result)))
        result.settings = self._settings

    def _fewest_bands(self, error: SquaredError) -> int:
        """The fewest bands that still meet the target, where all of them do and the user left the choice."""
        bands = self._settings.bands
        if "bands" in self.goal.kept or error.bound(_SURE) > self.goal.target:
            return bands
        for fewer in range(1, bands):
            if self._error(self._light.field_of(self._light.mean[:, : fewer**2])).bound(_SURE) <= self.goal.target:
                return fewer
        return bands

    def _adapt_bands(self, field: Field) -> dict:
        """Zeros for upper bands of ``field`` that say less than the target leaves; returns how many probes keep how
        many."""
        bands, active = field.bands, field.state == ACTIVE
        needed = np.full(self.grid.count, bands)
        error = self._error(field)
        left = self.goal.target**2 - max(error.value, 0.0) - _SURE * error.deviation
        if "bands" not in self.goal.kept and left > 0:
            needed = adaptive_bands.bands_needed(field.coefficients, active, _GIVEN_UP * left * self._check.scale)
            field.coefficients = adaptive_bands.without_upper_bands(field.coefficients, needed)
            along = field.gradient.swapaxes(1, 2)
            field.gradient = np.ascontiguousarray(adaptive_bands.without_upper_bands(along, needed).swapaxes(1, 2))
        return {str(count): int((needed[active] == count).sum()) for count in range(1, bands + 1)}

    def _said(self, field: Field, why: str) -> dict:
        """The part of the summary, of the file's metadata and of the report that tells of the error of ``field``."""
        target = self.goal.target
        final, floor = self._error(field), self._check.floor(field.bands)
        told = np.array(self._model.parts(self._level))
        texels, noise, rest = told * min(max(self._own_error().value, 0.0) / max(told.sum(), 1e-30), 1.0)
        met, predicted = final.bound(_SURE) <= target, max(final.estimate, floor.estimate)
        if not met:
            allowed = f"{field.bands} bands alone lose {100 * floor.estimate:.2g} %"
            self.result.warnings.append(
                f"{self.grid.name}: an error of {100 * target:g} % was not reached, it is {100 * predicted:.2g} % by "
                f"estimate (up to {100 * final.bound(_SURE):.2g} %); stopped by {why}; {allowed}"
            )
        between = self._between
        return {
            "target": target,
            "met": bool(met),
            "predicted": round(predicted, 6),
            "predicted_at_most": round(final.bound(_SURE), 6),
            "covers": "irradiance by what probes hold, where they stand; for places between them see 'between'",
            "parts": {
                "texels": round(float(np.sqrt(texels)), 6),
                "noise": round(float(np.sqrt(noise)), 6),
                "rest": round(float(np.sqrt(rest)), 6),
                "bounces": round(min(self.result.missing, 1.0), 6),
                "floor": round(floor.estimate, 6),
            },
            "between": round(between.estimate, 6) if between else None,
            "passes": self._passes,
            "paths": self._paths.count,
            "stopped": why,
        }


def _read(field: Field, points: np.ndarray) -> np.ndarray:
    """(K, N, 3) irradiance that ``field`` tells at ``points`` (K, 3) for NORMALS."""
    found = lookup.irradiance(field, np.repeat(points, len(NORMALS), axis=0), np.tile(NORMALS, (len(points), 1)))
    return found.reshape(len(points), len(NORMALS), 3)


def _baked(result: BakeResult) -> Field:
    assert result.field is not None  # a bake that came to its end has one
    return result.field
