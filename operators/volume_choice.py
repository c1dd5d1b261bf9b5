# SPDX-License-Identifier: GPL-3.0-or-later
"""Which volumes an operator or a panel is about, and the grid that each stands for."""

from __future__ import annotations

import bpy

from ..core.errors import InputError
from ..core.grid import Grid
from ..scene.field_storage import stored_text
from ..scene.volumes import box_of, is_volume, resolution_of
from .libraries import cannot_keep


def volumes_of(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The scene's volumes, by name."""
    return sorted((item for item in scene.objects if is_volume(item)), key=lambda item: item.name)


def active_volume(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active object if it is a volume, the volume of an active probe, or the scene's only volume."""
    item = context.view_layer.objects.active
    for candidate in (item, item.parent if item else None):
        if is_volume(candidate):
            return candidate
    volumes = volumes_of(context.scene)
    return volumes[0] if len(volumes) == 1 else None


def chosen_volumes(context: bpy.types.Context, everything: bool = False) -> list[bpy.types.Object]:
    """The active volume, or all where none is active or ``everything`` is asked for; only those whose light this file
    can keep.

    Raises:
        InputError: the scene has none, or there is none among these that this file can keep light for.
    """
    volumes = volumes_of(context.scene)
    if not volumes:
        raise InputError("the scene has no probe volume; add one with Add › Light Probe › Gridlight Volume")
    active = None if everything else active_volume(context)
    chosen = volumes if active is None else [active]
    own = [volume for volume in chosen if not cannot_keep(volume)]
    if not own:
        raise InputError(cannot_keep(chosen[0]))
    return own


def grid_of(volume: bpy.types.Object) -> Grid:
    """The volume's grid where it stands now.

    Raises:
        InputError: its box or its counts cannot be a grid.
    """
    return Grid(box_of(volume), resolution_of(volume), volume.name)


def can_read_scene(operator, context: bpy.types.Context) -> bool:
    """For ``poll``: object mode and no render under way, whose evaluation a reading would disturb; or a line that says
    so."""
    if bpy.app.is_job_running("RENDER"):
        operator.poll_message_set("Blender is rendering; wait until it is done")
        return False
    return in_object_mode(operator, context)


def in_object_mode(operator, context: bpy.types.Context) -> bool:
    """For ``poll``: object mode, or a line that says so."""
    if context.mode == "OBJECT":
        return True
    operator.poll_message_set("Switch to Object Mode first")
    return False


def has_volume(operator, context: bpy.types.Context) -> bool:
    """For ``poll``: the scene has a volume whose light this file can keep, or a line that says so."""
    reasons = [cannot_keep(volume) for volume in volumes_of(context.scene)]
    if not reasons:
        operator.poll_message_set("Add a probe volume first: Add › Light Probe › Gridlight Volume")
    elif all(reasons):
        operator.poll_message_set(reasons[0])
    return not all(reasons)


def has_light(operator, context: bpy.types.Context) -> bool:
    """For ``poll``: a volume of the scene holds baked light, or a line that says what to do."""
    if any(stored_text(volume) for volume in volumes_of(context.scene)):
        return True
    operator.poll_message_set("Nothing is baked; bake a volume first")
    return False
