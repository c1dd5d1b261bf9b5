# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sets on objects: lights and volumes.

Both keep what a bake needs as plain custom properties (``scene/volumes.py``, ``scene/lights.py``), so that a file bakes
alike where the extension is not installed. The groups here are windows onto those.
"""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntVectorProperty

from ..core.settings import MAX_RESOLUTION
from ..scene import lights, volumes

_ROLE_ITEMS = [
    ("STATIC", "Static", "Stands still and keeps its power: its direct light is computed once"),
    ("DYNAMIC", "Dynamic", "May move or change: its direct light is computed anew. Animated lights always are"),
]
_GROUP_ITEMS = [
    ("NONE", "None", "In no group"),
    ("CEILING_1", "Ceiling 1", "First group of ceiling lights; keys 1 and 2 in Explore mode"),
    ("CEILING_2", "Ceiling 2", "Second group of ceiling lights; keys 3 and 4 in Explore mode"),
    ("WALL", "Wall", "Wall lights; keys 5 and 6 in Explore mode"),
    ("DYNAMIC", "Dynamic", "The moving light; keys 7 and 8 in Explore mode"),
]
# Group as a custom property holds it; other texts are groups of the user's own and shown as none.
_STORED_GROUPS = ("", "ceiling1", "ceiling2", "wall", "dynamic")


def _get_role(self) -> int:
    return int(self.id_data.get(lights.ROLE_PROPERTY) == "dynamic")


def _set_role(self, index: int) -> None:
    self.id_data[lights.ROLE_PROPERTY] = "dynamic" if index else "static"


def _get_group(self) -> int:
    stored = str(self.id_data.get(lights.GROUP_PROPERTY, ""))
    return _STORED_GROUPS.index(stored) if stored in _STORED_GROUPS else 0


def _set_group(self, index: int) -> None:
    self.id_data[lights.GROUP_PROPERTY] = _STORED_GROUPS[index]


def _get_intensity(self) -> float:
    return float(self.id_data.get(lights.INTENSITY_PROPERTY, 1.0))


def _set_intensity(self, value: float) -> None:
    self.id_data[lights.INTENSITY_PROPERTY] = value


def _light_changed(self, _context) -> None:
    # Custom properties that Python writes are no news to the depsgraph by themselves; a running preview waits for it.
    self.id_data.update_tag()


class GridlightLight(bpy.types.PropertyGroup):
    """What a light object, or an object that glows, is for."""

    role: EnumProperty(
        name="Role",
        description="Whether the light may change between frames",
        items=_ROLE_ITEMS,
        get=_get_role,
        set=_set_role,
        update=_light_changed,
        options=set(),
    )
    group: EnumProperty(
        name="Group",
        description="Lights that Explore mode turns up and down together",
        items=_GROUP_ITEMS,
        get=_get_group,
        set=_set_group,
        update=_light_changed,
        options=set(),
    )
    intensity: FloatProperty(
        name="Intensity",
        description="Factor on the light's own power, or on the object's emission",
        get=_get_intensity,
        set=_set_intensity,
        update=_light_changed,
        min=0.0,
        soft_max=4.0,
        options=set(),
    )
    animate: BoolProperty(
        name="Animate",
        description="Let this light's animation run in Explore mode; key 9 starts and stops it",
        default=True,
        options=set(),
    )


def _get_resolution(self) -> tuple[int, int, int]:
    return volumes.resolution_of(self.id_data)


def _set_resolution(self, counts) -> None:
    self.id_data[volumes.RESOLUTION] = [int(count) for count in counts]


def _get_spacing(self) -> float:
    box, counts = volumes.box_of(self.id_data), volumes.resolution_of(self.id_data)
    wanted = self.wanted_spacing
    if wanted > 0 and volumes.resolution_for(box, wanted) == counts:
        return wanted  # what was typed, while it still leads to these counts
    return float((2 * np.linalg.norm(box[:3, :3], axis=0) / np.maximum(np.array(counts) - 1, 1)).max())


def _set_spacing(self, spacing: float) -> None:
    self.wanted_spacing = spacing
    self.id_data[volumes.RESOLUTION] = list(volumes.resolution_for(volumes.box_of(self.id_data), spacing))


class GridlightVolume(bpy.types.PropertyGroup):
    """The grid of a volume Empty."""

    resolution: IntVectorProperty(
        name="Probes",
        description="Number of probes along the volume's own axes; a count of 1 puts the probe in the middle",
        size=3,
        min=1,
        max=MAX_RESOLUTION,
        get=_get_resolution,
        set=_set_resolution,
        options=set(),
    )
    spacing: FloatProperty(
        name="Spacing",
        description="Distance between probes. Setting it chooses the counts that come nearest along each axis",
        unit="LENGTH",
        subtype="DISTANCE",
        min=1e-3,
        soft_max=10.0,
        get=_get_spacing,
        set=_set_spacing,
        options=set(),
    )
    wanted_spacing: FloatProperty(description="The spacing as it was set, metres; 0 for none", options={"HIDDEN"})
