# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes as objects: one small Empty per probe that lights something, in the collection "Gridlight Probes".

They show where the light is sampled and can be selected like anything else; a bake computes its probes from the volume
and never reads these back. With probes of several volumes each volume gets a collection of its own inside.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core.conventions import ACTIVE
from ..core.grid import Grid

COLLECTION = "Gridlight Probes"
VOLUME_PROPERTY, INDEX_PROPERTY = "gridlight_probe_volume", "gridlight_probe_index"
_COLLECTION_MARK = "gridlight_probes"  # value: volume name, or "" on the collection that holds all
_DISPLAY_SHARE = 0.06  # of the shortest cell edge: visible, and far from touching the next one
_NAME_BYTES = 48  # Blender cuts names at 63 bytes; this leaves room for the index


def place_probes(
    scene: bpy.types.Scene, grid: Grid, state: np.ndarray, volume_object: bpy.types.Object | None = None
) -> bpy.types.Collection:
    """Places an Empty at every active probe of ``grid`` and returns the collection that holds them.

    Probes that this volume has in the scene already are replaced. ``state`` (P,) holds the states of
    ``core.conventions``; culled and invalid probes get no object. The volume is known by the name of
    ``volume_object``, or by that of ``grid`` where it has no object.
    """
    volume = volume_object.name if volume_object else grid.name
    clear_probes(scene, volume)
    root = _find(scene, "") or _make(scene.collection, COLLECTION, "")
    target = _home(root, volume)
    stem = volume.encode()[:_NAME_BYTES].decode(errors="ignore")
    digits = len(str(grid.count - 1))
    size = _DISPLAY_SHARE * float(grid.cell_size().min())
    positions = grid.positions()
    for index in np.flatnonzero(np.asarray(state) == ACTIVE).tolist():
        probe = bpy.data.objects.new(f"{stem} {index:0{digits}d}", None)
        probe.empty_display_type = "SPHERE"
        probe.empty_display_size = size
        probe.location = positions[index]
        probe[VOLUME_PROPERTY] = volume
        probe[INDEX_PROPERTY] = index
        target.objects.link(probe)
    return target


def clear_probes(scene: bpy.types.Scene, volume: str | None = None) -> int:
    """Removes the probes of ``volume``, or all, and the collections that are empty then. Returns how many probes went.

    Objects that somebody else put into these collections stay, and so do their collections.
    """
    root = _find(scene, "")
    if root is None:
        return 0
    gone = [
        probe for probe in root.all_objects if VOLUME_PROPERTY in probe and volume in (None, probe[VOLUME_PROPERTY])
    ]
    bpy.data.batch_remove(gone)
    for collection in [*root.children_recursive, root]:
        if _COLLECTION_MARK in collection and not collection.all_objects and not collection.children:
            bpy.data.collections.remove(collection)
    return len(gone)


def placed_volumes(scene: bpy.types.Scene) -> set[str]:
    """Names of the volumes that have probes in ``scene``."""
    root = _find(scene, "")
    return {probe[VOLUME_PROPERTY] for probe in root.all_objects if VOLUME_PROPERTY in probe} if root else set()


def _home(root: bpy.types.Collection, volume: str) -> bpy.types.Collection:
    """The collection for probes of ``volume``: ``root`` itself while no other volume has probes in it."""
    by_volume: dict[str, list[bpy.types.Object]] = {}
    for probe in root.all_objects:
        if VOLUME_PROPERTY in probe:
            by_volume.setdefault(probe[VOLUME_PROPERTY], []).append(probe)
    if not by_volume:
        return root
    for other, probes in by_volume.items():
        own = _child(root, other)
        for probe in probes:
            if root.objects.get(probe.name) is probe:
                root.objects.unlink(probe)
                own.objects.link(probe)
    return _child(root, volume)


def _child(root: bpy.types.Collection, volume: str) -> bpy.types.Collection:
    marked = (child for child in root.children if child.get(_COLLECTION_MARK) == volume)
    return next(marked, None) or _make(root, volume, volume)


def _find(scene: bpy.types.Scene, mark: str) -> bpy.types.Collection | None:
    """The scene's collection with this mark: users may rename and move it, and other scenes have their own."""
    return next((item for item in scene.collection.children_recursive if item.get(_COLLECTION_MARK) == mark), None)


def _make(parent: bpy.types.Collection, name: str, mark: str) -> bpy.types.Collection:
    collection = bpy.data.collections.new(name)
    collection[_COLLECTION_MARK] = mark
    collection.color_tag = "COLOR_03"
    parent.children.link(collection)
    return collection
