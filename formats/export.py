# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake as files that an engine loads: what ``gridlight export`` and the Export panel call.

Every target is a module of this folder, ``export_*.py``, with

* ``AXES``, ``PRECISION``: what the engine expects unless the user says otherwise; ``BANDS``: the most it can use;
* ``SUFFIX``: of its one file, or None where it fills a folder;
* ``ENGINE``, ``STORED``, ``DOES_NOT_CARRY``, ``RUN_IN_ENGINE``: for the file of conventions;
* ``write(job) -> dict``: stages the files and returns what the conventions say about their layout.

docs/export.md derives the scale factors and says which targets were run in the engine.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..core import dilation, ringing, windowing
from ..core.conventions import ACTIVE, MAX_BANDS
from ..core.errors import InputError
from ..core.field import Field, state_counts
from ..core.gradients import gradient_bands
from . import (
    export_bevy,
    export_cubemap,
    export_filament,
    export_flipbook,
    export_godot,
    export_json,
    export_three,
    export_three_light,
    export_unity,
)
from .export_lattice import Lattice, Resampling, axes_matrix, converted
from .export_numbers import PRECISIONS, Encoder
from .probe_metadata import program_version
from .staging import StagedFolder

TARGETS = {
    "three": export_three,
    "godot": export_godot,
    "unity": export_unity,
    "bevy": export_bevy,
    "exr-flipbook": export_flipbook,
    "json": export_json,
    "cubemap": export_cubemap,
    "three-light": export_three_light,
    "filament": export_filament,
}
INACTIVE = ("fill", "zero")
LAYOUTS = ("cross", "faces", "equirect")


@dataclass(frozen=True)
class ExportOptions:
    """What the user may choose about an export. None: what the target expects.

    Raises:
        InputError: a value is out of range.
    """

    axes: str | None = None  # see export_lattice.axes_matrix
    scale: float = 1.0  # target units per metre
    bands: int | None = None
    window: str = "none"  # none, auto, hann:W, lanczos:W
    precision: str | None = None
    inactive: str = "fill"  # probes without light of their own: their neighbours' light, or none
    gain: float = 1.0  # factor on all light
    refine: int = 1  # three: cells of the atlas along each edge of a cell
    probe: tuple[int, int, int] | None = None  # of one probe: which; None: the active one nearest to the middle
    layout: str = "cross"
    size: int = 64  # cubemap: edge of a face, height of a panorama

    def __post_init__(self):
        if self.bands is not None and not 1 <= self.bands <= MAX_BANDS:
            raise InputError(f"--bands is {self.bands}; it must lie between 1 and {MAX_BANDS}")
        for name in ("scale", "gain"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"--{name} is {value}; it must be a number greater than 0")
        for name, most in (("size", 4096), ("refine", 16)):
            if not 1 <= getattr(self, name) <= most:
                raise InputError(f"--{name} is {getattr(self, name)}; it must lie between 1 and {most}")
        for name, allowed in (("inactive", INACTIVE), ("layout", LAYOUTS), ("precision", (None, *PRECISIONS))):
            if getattr(self, name) not in allowed:
                raise InputError(f"--{name} {getattr(self, name)}: choose {' or '.join(filter(None, allowed))}")
        window_factors(self.window, 1)


@dataclass
class ExportJob:
    """What a target's ``write`` gets: the light, where to stage files, and where to leave notes."""

    lattice: Lattice
    source: Field  # as it was read
    options: ExportOptions
    encode: Encoder
    folder: StagedFolder
    stem: str  # of the files' names
    warnings: list[str] = field(default_factory=list)
    resampling: Resampling | None = None

    def path(self, ending: str) -> Path:
        """Where to write the file ``stem + ending``."""
        return self.folder.path(self.stem + ending)

    def straightened(self, resampled: Lattice, resampling: Resampling | None) -> Lattice:
        """Notes that a rotated volume was ``resampled``, and hands it on."""
        self.resampling = resampling
        if resampling:
            shown = " × ".join(map(str, resampling.resolution))
            self.warnings.append(
                f"the volume is rotated, which this format cannot say: resampled to {shown} probes along the axes, "
                f"which differ by {100 * resampling.relative_rms:.2g} % between probes"
            )
        return resampled


@dataclass(frozen=True)
class ExportResult:
    """``files`` by path; ``does_not_carry`` and ``warnings`` for the user; ``conventions`` as written beside."""

    files: list[str]
    does_not_carry: list[str]
    warnings: list[str]
    conventions: dict


def check_path(target: str, path) -> tuple[Path, str]:
    """(folder, stem) of the files that ``target`` writes for ``path``: a folder, or a file's name where there is one.

    Raises:
        InputError: the target is unknown, or the name does not fit it.
    """
    if target not in TARGETS:
        raise InputError(f"--to {target}: choose one of {', '.join(TARGETS)}")
    suffix = TARGETS[target].SUFFIX
    path = Path(path)
    if path.is_dir() or not path.suffix:
        return path, target if suffix == ".exr" else "probes"  # probes.exr is the probe file itself
    if path.suffix.lower() != suffix:
        wanted = f"a {suffix} file or a folder" if suffix else "a folder"
        raise InputError(f"{path}: {target} writes {wanted}; name one with -o")
    return path.parent, path.stem


def export(
    source: Field, target: str, path, options: ExportOptions, source_path="", extra=lambda job: {}
) -> ExportResult:
    """Writes ``source``, which was read from ``source_path``, for ``target`` to ``path``: all files or none.

    ``extra(job)`` may stage more files before the end and returns what the conventions say about them.

    Raises:
        InputError: ``path`` or the options do not fit the target or the field, or a file would replace the source.
    """
    folder, stem = check_path(target, path)
    module = TARGETS[target]
    prepared, filled = prepare(source, options, module.BANDS)
    axes = axes_matrix(module.AXES if options.axes is None else options.axes)
    encode = Encoder(options.precision or module.PRECISION)
    with StagedFolder(folder) as staged:
        job = ExportJob(converted(prepared, axes, options.scale), source, options, encode, staged, stem)
        layout = module.write(job)
        layout.update(extra(job))
        job.warnings += encode.warnings()
        conventions = {"format": target, **_conventions(module, job, axes, layout, Path(source_path).name, filled)}
        for name in staged.names:
            if source_path and Path(source_path).resolve() == (folder / name).resolve():
                raise InputError(f"{folder / name} is the probe file itself; choose another name with -o")
        job.path(".conventions.json").write_text(json.dumps(conventions, indent=2) + "\n", encoding="utf-8")
    files = [os.fspath(folder / name) for name in staged.names]
    return ExportResult(files, conventions["does_not_carry"], job.warnings, conventions)


def prepare(source: Field, options: ExportOptions, most_bands: int) -> tuple[Field, bool]:
    """``source`` as ``options`` ask for it, in Blender's axes still, and whether probes were filled here.

    A bake has filled culled and invalid probes already; where a file holds none of that light, it is done now.

    Raises:
        InputError: more bands than ``source`` holds or the target can use.
    """
    bands = min(source.bands, most_bands) if options.bands is None else options.bands
    if bands > source.bands:
        raise InputError(f"--bands {bands}: the probe file holds {source.bands}; bake with more, or ask for fewer")
    if bands > most_bands:
        raise InputError(f"--bands {bands}: this format holds {most_bands} at most")
    coefficients = source.coefficients[:, : bands * bands].astype(np.float32)
    gradient = source.gradient[:, :, : gradient_bands(bands) ** 2]
    active = source.state == ACTIVE
    filled = False
    if options.inactive == "zero":
        coefficients[~active] = 0
    elif not coefficients[~active].any() and coefficients[active].any():
        coefficients = dilation.fill(source.grid, coefficients, active)
        filled = True
    if options.window == "auto":
        window = ringing.dering(coefficients)
        coefficients = window.coefficients
        gradient = gradient * ringing.band_factors(window.factors, gradient_bands(bands))[:, None, :, None]
    factors = options.gain * window_factors(options.window, bands)
    coefficients = windowing.apply(coefficients, factors).astype(np.float32)
    along = gradient.reshape(-1, *gradient.shape[2:])
    gradient = windowing.apply(along, factors[: gradient_bands(bands)]).reshape(gradient.shape).astype(np.float32)
    prepared = Field(
        source.grid, coefficients, source.state, source.validity, source.offset, source.depth, gradient=gradient
    )
    return prepared, filled


def window_factors(window: str, bands: int) -> np.ndarray:
    """(bands,) factors of ``window``: none, hann:W or lanczos:W; all 1 for auto, which depends on the probe.

    Raises:
        InputError: it is none of these.
    """
    kind, _, width = window.partition(":")
    shapes = {"hann": windowing.hann, "lanczos": windowing.lanczos}
    if kind in shapes:
        try:
            value = float(width)
        except ValueError:
            value = 0.0
        if np.isfinite(value) and value > 0:
            return shapes[kind](bands, value)
    elif window in ("none", "auto"):
        return np.ones(bands)
    raise InputError(f"--window {window}: choose none, auto, hann:W or lanczos:W with a width W in bands, like hann:4")


def _conventions(module, job: ExportJob, axes: np.ndarray, layout: dict, source_name: str, filled: bool) -> dict:
    source, options, lattice = job.source, job.options, job.lattice
    letters = [
        "".join(f"{'-' if value < 0 else '+'}{'xyz'[i]}" for i, value in enumerate(row) if value) for row in axes
    ]
    inactive = {"fill": "light of their neighbours", "zero": "no light"}[options.inactive]
    return {
        "generator": f"Gridlight {program_version()}",
        "engine": module.ENGINE,
        "run_in_engine": module.RUN_IN_ENGINE,
        "source": {
            "file": source_name,
            "volume": source.grid.name,
            "resolution": list(source.grid.resolution),
            "bands": source.bands,
            "scene_hash": source.metadata.get("scene_hash"),
        },
        "space": {
            "x_y_z_are_blenders": letters,
            "handedness": "right" if np.linalg.det(axes) > 0 else "left",
            "units_per_metre": options.scale,
            "volume_matrix": lattice.grid.matrix.tolist(),
        },
        "light": {
            "stored": module.STORED,
            "color": "scene-linear Rec. 709 RGB",
            "bands": lattice.bands,
            "window": options.window,
            "gain": options.gain,
            "precision": job.encode.precision,
        },
        "probes": {
            **state_counts(source.state),
            "culled_and_invalid_hold": inactive + (" (filled on export)" if filled else ""),
        },
        "resampled": None
        if job.resampling is None
        else {
            "resolution": list(job.resampling.resolution),
            "relative_rms_between_probes": job.resampling.relative_rms,
        },
        "layout": layout,
        "does_not_carry": list(module.DOES_NOT_CARRY)
        + ([f"bands above {lattice.bands}"] if lattice.bands < source.bands else []),
    }
