# SPDX-License-Identifier: GPL-3.0-or-later
"""What an update of the depsgraph means for the light, as kinds of change.

======== =============================================== =======================================
kind     what changed                                    what has to be done
======== =============================================== =======================================
lights   a lamp moved, changed or came into the scene    lamps are read again; light follows
world    the background                                  background is read again; light follows
surfaces shape, place, material or visibility of objects scene is read again; light follows
fields   another bake is stored                          fields are loaded again
======== =============================================== =======================================
"""

from __future__ import annotations

import bpy

LIGHTS, WORLD, SURFACES, FIELDS = "lights", "world", "surfaces", "fields"
_SURFACE_IDS = (bpy.types.Mesh, bpy.types.Curve, bpy.types.MetaBall, bpy.types.Material, bpy.types.Image)
_WITH_SURFACE = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


def kinds_of(depsgraph: bpy.types.Depsgraph) -> set[str]:
    """Kinds of change among ``depsgraph.updates``; empty for selections, cameras and everything else without light."""
    kinds = set()
    for update in depsgraph.updates:
        block = update.id
        if isinstance(block, bpy.types.Object):
            kinds |= _of_object(block, update)
        elif isinstance(block, bpy.types.Light):
            kinds.add(LIGHTS)
        elif isinstance(block, bpy.types.World):
            kinds.add(WORLD)
        elif isinstance(block, _SURFACE_IDS):
            kinds.add(SURFACES)
    return kinds


def _of_object(item: bpy.types.Object, update: bpy.types.DepsgraphUpdate) -> set[str]:
    moved = update.is_updated_transform or update.is_updated_geometry or update.is_updated_shading
    if not moved:
        return set()
    if item.type == "LIGHT":
        return {LIGHTS}
    if item.type in _WITH_SURFACE:
        return {SURFACES}
    if item.instance_type == "COLLECTION":
        return {SURFACES, LIGHTS}
    return set()
