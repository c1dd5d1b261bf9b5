# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sets for a scene: bakes and preview, and the bake settings made from it."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ..core.error_budget import LEAST_TARGET, MOST_TARGET, ErrorGoal
from ..core.settings import FACE_SIZES, BakeSettings
from .export_targets import TARGET_ITEMS
from .object_properties import GridlightLight, GridlightVolume
from .quality import QUALITIES

_STANDARD = BakeSettings()

_QUALITY_ITEMS = [
    *((key, quality.name, quality.description, index) for index, (key, quality) in enumerate(QUALITIES.items())),
    ("CUSTOM", "Custom", "Settings of your own; their error is not measured in advance", len(QUALITIES)),
]
_CAPTURE_ITEMS = [
    ("auto", "Automatic", "Whichever of the two costs less for this number of triangles"),
    ("raster", "Raster", "Draw the scene for each probe; good for few triangles"),
    ("trace", "Trace", "Send rays through the scene; cost hardly grows with the number of triangles"),
]
_MODE_ITEMS = [
    ("FULL", "Full", "Direct light and the light of the probes"),
    ("DIRECT", "Direct", "Light that comes straight from lamps"),
    ("INDIRECT", "Indirect", "Only what the probes add: bounced light, emission and sky"),
    ("IRRADIANCE", "Irradiance", "Light that arrives, without the colour of the surfaces"),
    ("NORMALS", "Normals", "Direction of the surfaces as colour"),
    ("VALIDITY", "Validity", "How far the probes around a surface may be trusted: green fully, red not at all"),
    ("ERROR", "Error", "Estimated error of each cell"),
]
_CURVE_ITEMS = [
    ("STANDARD", "Standard", "As Blender's Standard view transform"),
    ("FILMIC", "Filmic", "Rolls highlights off softly"),
    ("LINEAR", "Linear", "No curve: for reading values, not for looking at"),
]
_SHADING_ITEMS = [
    ("IRRADIANCE", "Irradiance", "What a white diffuse surface would show in each direction"),
    ("RADIANCE", "Radiance", "What the probe sees in each direction"),
]


def _preview_changed(preview, _context) -> None:
    from .. import viewport  # not above: its drawing is wanted only once somebody looks

    viewport.sync(preview.id_data)


class GridlightPreview(bpy.types.PropertyGroup):
    """How the viewport shows the baked light."""

    enabled: BoolProperty(
        name="Preview",
        description="Show direct light and baked light in the 3D viewport",
        update=_preview_changed,
        options=set(),
    )
    mode: EnumProperty(name="Mode", description="What the preview shows", items=_MODE_ITEMS, options=set())
    exposure: FloatProperty(
        name="Exposure",
        description="Brightness of the preview in stops: each doubles the light",
        soft_min=-8.0,
        soft_max=8.0,
        min=-32.0,
        max=32.0,
        step=10,
        options=set(),
    )
    tone_curve: EnumProperty(
        name="Tone Curve", description="How light becomes colour on the screen", items=_CURVE_ITEMS, options=set()
    )
    indirect: FloatProperty(
        name="Indirect",
        description="Factor on the light of the probes, for looking only; 1 is what was baked",
        default=1.0,
        min=0.0,
        max=4.0,
        options=set(),
    )
    highlight: FloatProperty(
        name="Highlight",
        description="Share of direct light that surfaces mirror in a soft highlight, for looking only; paint, plastics "
        "and glass mirror 0.04 of it head-on",
        default=0.04,
        min=0.0,
        max=1.0,
        options=set(),
    )
    show_probes: BoolProperty(name="Probes", description="Show each probe as a sphere in its own light", options=set())
    probe_size: FloatProperty(
        name="Size",
        description="Diameter of the spheres as a share of the shortest cell edge",
        default=0.2,
        min=0.01,
        max=1.0,
        subtype="FACTOR",
        options=set(),
    )
    probe_shading: EnumProperty(
        name="Shading", description="What the spheres show", items=_SHADING_ITEMS, options=set()
    )
    show_rate: BoolProperty(
        name="Rate", description="Show frames a second, probes a frame and the age of the light", options=set()
    )
    live: BoolProperty(
        name="Live",
        description="Follow changes of lights, world and objects while the preview is on, a part of the probes a frame",
        default=True,
        options=set(),
    )
    frame_budget_ms: FloatProperty(
        name="Frame Budget",
        description="Time that a frame may take, in milliseconds, drawing and updates together; 16.6 keeps 60 frames a "
        "second. Updates take what drawing leaves, at least half",
        default=16.6,
        min=1.0,
        max=1000.0,
        soft_max=100.0,
        precision=1,
        options=set(),
    )


def _get_quality(self) -> int:
    if not self.custom:
        for index, quality in enumerate(QUALITIES.values()):
            # Floats travel through 32 bits.
            if all(np.isclose(getattr(self, name), value, rtol=1e-5) for name, value in quality.settings.items()):
                return index
    return len(QUALITIES)


def _set_quality(self, index: int) -> None:
    self.custom = index == len(QUALITIES)
    if not self.custom:
        for name, value in list(QUALITIES.values())[index].settings.items():
            setattr(self, name, value)


class GridlightExport(bpy.types.PropertyGroup):
    """Where baked light goes, and how."""

    target: EnumProperty(name="Format", description="What the files are for", items=TARGET_ITEMS, options=set())
    directory: StringProperty(
        name="Folder",
        description='Where the files go; empty is a folder "gridlight" beside this .blend',
        subtype="DIR_PATH",
        options=set(),
    )
    dering: BoolProperty(
        name="Deringing",
        description="Dampen probes whose light would be negative in some directions, as little as that takes",
        options=set(),
    )
    scale: FloatProperty(
        name="Scale", description="Units of the engine per metre", default=1.0, min=1e-4, max=1e4, options=set()
    )
    gain: FloatProperty(
        name="Gain", description="Factor on all light that is written", default=1.0, min=1e-6, max=1e6, options=set()
    )


class GridlightSettings(bpy.types.PropertyGroup):
    """What the user chose for a scene's bakes and its preview."""

    quality: EnumProperty(
        name="Quality",
        description="Settings for a purpose, with the error that was measured for them",
        items=_QUALITY_ITEMS,
        get=_get_quality,
        set=_set_quality,
        options=set(),
    )
    use_error: BoolProperty(
        name="Target Error",
        description="Ask for an error instead of settings: face size, samples, tolerance and bands are then chosen",
        options=set(),
    )
    target_error_percent: FloatProperty(
        name="Target Error",
        description="Error of the light at probes to aim for, in percent. The bake starts cheap, checks itself by "
        "paths of light, refines until the target is met, and says what it reached",
        default=2.0,
        min=100 * LEAST_TARGET,
        max=100 * MOST_TARGET,
        soft_min=0.5,
        soft_max=20.0,
        subtype="PERCENTAGE",
        step=10,
        precision=1,
        options=set(),
    )
    custom: BoolProperty(description="Custom was chosen although the settings equal a preset", options={"HIDDEN"})
    bands: IntProperty(
        name="Bands",
        description="Spherical-harmonic bands kept in each probe. Three carry all diffuse light; a fourth only "
        "sharpens radiance lookups",
        default=_STANDARD.bands,
        min=1,
        max=4,
        options=set(),
    )
    face: IntProperty(
        name="Face Size",
        description="Texels along the edge of a probe's six images. Doubling it halves aliasing and costs four times "
        "the memory and time",
        default=_STANDARD.face,
        min=FACE_SIZES[0],
        max=FACE_SIZES[-1],
        options=set(),
    )
    bounces_auto: BoolProperty(
        name="Bounces until Settled",
        description="Let light bounce until less than the tolerance is missing",
        default=_STANDARD.bounces is None,
        options=set(),
    )
    bounces: IntProperty(
        name="Bounces",
        description="How often light bounces between surfaces; 0 is direct light alone",
        default=4,
        min=0,
        max=10_000,
        soft_max=64,
        options=set(),
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Share of the light that may still be missing when bounces stop",
        default=_STANDARD.tolerance,
        min=1e-6,
        max=1.0,
        soft_max=0.1,
        precision=4,
        step=0.1,
        options=set(),
    )
    gather: IntProperty(
        name="Gather",
        description="Bounces that every texel traces before patches are read. 1 gains little over more Light Samples "
        "in most scenes and makes a bake several times longer",
        default=_STANDARD.gather,
        min=0,
        max=16,
        soft_max=2,
        options=set(),
    )
    samples: IntProperty(
        name="Light Samples",
        description="How many times the rays and the samples of light that each patch takes; more take out noise",
        default=_STANDARD.samples,
        min=1,
        max=4096,
        soft_max=16,
        options=set(),
    )
    capture: EnumProperty(
        name="Capture",
        description="How probes see the scene; the result is the same",
        items=_CAPTURE_ITEMS,
        options=set(),
    )
    seed: IntProperty(
        name="Seed",
        description="Start of the random numbers; the same seed gives the same bake",
        default=_STANDARD.seed,
        min=0,
        max=2**31 - 1,
        options=set(),
    )
    keep_all: BoolProperty(
        name="Keep All Probes",
        description="Bake probes that light no surface as well",
        default=_STANDARD.keep_all,
        options=set(),
    )
    deringing: BoolProperty(
        name="Deringing",
        description="Dampen probes whose light would fall below zero in some directions, as little as that takes",
        default=_STANDARD.deringing,
        options=set(),
    )
    memory_mib: IntProperty(
        name="Memory (MiB)",
        description="Limit for what probes keep on the GPU during a bake. Where it is too small, probes are "
        "captured again for every bounce",
        default=_STANDARD.memory_mib,
        min=16,
        max=1 << 20,
        options=set(),
    )
    preview: PointerProperty(type=GridlightPreview)
    export: PointerProperty(type=GridlightExport)
    active_light: IntProperty(name="Light", description="Light that is chosen in the list", options={"HIDDEN"})

    def error_goal(self) -> ErrorGoal | None:
        """The error that bakes aim for, if one is asked for. Fewer or more bands than usual are then the user's own
        choice."""
        if not self.use_error:
            return None
        kept = {"bands"} if self.bands != _STANDARD.bands else set()
        return ErrorGoal(float(f"{self.target_error_percent / 100:.6g}"), frozenset(kept))

    def bake_settings(self) -> BakeSettings:
        """The validated settings of a bake: the one place where they are made from what the user set.

        Raises:
            InputError: a value is out of range, which the properties' own limits do not let happen.
        """
        return BakeSettings(
            bands=self.bands,
            face=self.face,
            bounces=None if self.bounces_auto else self.bounces,
            tolerance=float(f"{self.tolerance:.6g}"),  # as it was typed, not as 32 bits hold it
            gather=self.gather,
            samples=self.samples,
            capture=self.capture,
            seed=self.seed,
            keep_all=self.keep_all,
            memory_mib=self.memory_mib,
            deringing=self.deringing,
        )


classes = (GridlightPreview, GridlightExport, GridlightSettings, GridlightLight, GridlightVolume)


def attach() -> None:
    """Gives scenes and objects their groups; ``classes`` must be registered."""
    bpy.types.Scene.gridlight = PointerProperty(type=GridlightSettings)
    bpy.types.Object.gridlight_light = PointerProperty(type=GridlightLight)
    bpy.types.Object.gridlight_grid = PointerProperty(type=GridlightVolume)


def detach() -> None:
    """Takes the groups away; what custom properties hold stays in the file."""
    del bpy.types.Object.gridlight_grid
    del bpy.types.Object.gridlight_light
    del bpy.types.Scene.gridlight
