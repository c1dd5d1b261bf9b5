# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes as objects: one small Empty per probe that lights something, in the collection "Gridlight Probes".

They show where the light is sampled and are there to be edited: deleting one switches its node off, moving one moves
the place where it captures, within its cell. The collection remembers what was placed; without it nothing counts as
deleted. With probes of several volumes each volume gets a collection of its own inside. Grids with more than
``OBJECT_LIMIT`` probes get no objects, only the memory of them, which the viewport draws as points.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core.conventions import ACTIVE, CULLED
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits, bounded
from .volumes import box_of, is_volume, resolution_of

COLLECTION = "Gridlight Probes"
OBJECT_LIMIT = 2000  # more objects than this make Blender's own interface slow
VOLUME_PROPERTY, INDEX_PROPERTY = "gridlight_probe_volume", "gridlight_probe_index"
_COLLECTION_MARK = "gridlight_probes"  # value: volume name, or "" on the collection that holds all
_RECORDS = "gridlight_placed"  # on the collection that holds all, by volume name: volume, state, resolution
_DISPLAY_SHARE = 0.06  # of the shortest cell edge: visible, and far from touching the next one
_NAME_BYTES = 48  # Blender cuts names at 63 bytes; this leaves room for the index
_MOVED = 1e-4  # of the shortest cell edge: less is rounding


def place_probes(
    scene: bpy.types.Scene,
    grid: Grid,
    state: np.ndarray,
    volume_object: bpy.types.Object | None = None,
    edits: ProbeEdits | None = None,
) -> bpy.types.Collection:
    """Places an Empty at every active probe of ``grid`` and returns the collection that holds them.

    Probes that this volume has in the scene already are replaced. ``state`` (P,) holds the states of
    ``core.conventions``; culled and invalid probes get no object, nor do those that ``edits`` disables. The volume is
    known by the name of ``volume_object``, or by that of ``grid`` where it has no object; with an object a later
    ``read_edits`` tells what was done to them. Probes are nobody's children: hundreds of dashed lines to their volume
    would hide the scene. When the volume moves, they stay until they are placed again, and edits move with the volume.
    """
    volume = volume_object.name if volume_object else grid.name
    before, _ = _record_of(_find(scene, ""), volume_object)
    for name in {volume, before} - {None}:  # the volume may have been renamed
        clear_probes(scene, name)
    root = _find(scene, "") or _make(scene.collection, COLLECTION, "")
    target = _home(root, volume)
    edits = edits or ProbeEdits.none(grid)
    active = np.asarray(state) == ACTIVE
    if volume_object is not None:
        _remember(root, volume, volume_object, grid, active)
    if active.sum() > OBJECT_LIMIT:
        return target
    stem = volume.encode()[:_NAME_BYTES].decode(errors="ignore")
    digits = len(str(grid.count - 1))
    size = _DISPLAY_SHARE * float(grid.cell_size().min())
    positions = grid.positions() + edits.offset
    for index in np.flatnonzero(active & ~edits.disabled).tolist():
        probe = bpy.data.objects.new(f"{stem} {index:0{digits}d}", None)
        probe.empty_display_type = "SPHERE"
        probe.empty_display_size = size
        probe.location = positions[index]
        probe[VOLUME_PROPERTY] = volume
        probe[INDEX_PROPERTY] = index
        target.objects.link(probe)
    return target


def read_edits(scene: bpy.types.Scene, volume_object: bpy.types.Object) -> ProbeEdits | None:
    """What the user did to the placed probes of a volume: deleted ones are disabled, moved ones have an offset.

    Offsets are held within the probe's cell. None where no probes are placed for the volume's present counts, where
    they are points, or where nothing was changed.
    """
    root = _find(scene, "")
    volume, record = _record_of(root, volume_object)
    if record is None or tuple(record["resolution"]) != resolution_of(volume_object):
        return None
    placed = np.frombuffer(record["active"], np.uint8).astype(bool)
    if placed.sum() > OBJECT_LIMIT:
        return None
    grid = Grid(box_of(volume_object), resolution_of(volume_object), volume_object.name)
    placed_grid = Grid(_placed_box(record), grid.resolution, volume_object.name)
    nodes = placed_grid.positions()
    offset = np.zeros((grid.count, 3))
    found = np.zeros(grid.count, bool)
    for probe in root.all_objects:
        if probe.get(VOLUME_PROPERTY) == volume and 0 <= probe.get(INDEX_PROPERTY, -1) < grid.count:
            index = probe[INDEX_PROPERTY]
            found[index] = True
            offset[index] = _place_of(probe) - nodes[index]
    offset[np.abs(offset).max(axis=1) < _MOVED * placed_grid.cell_size().min()] = 0.0
    offset = offset @ np.linalg.inv(placed_grid.matrix[:3, :3]).T @ grid.matrix[:3, :3].T  # with the volume
    edits = ProbeEdits(placed & ~found, bounded(grid, offset))
    return edits if edits.any else None


def edits_of(scene: bpy.types.Scene, grid: Grid) -> ProbeEdits | None:
    """What ``read_edits`` says about the volume that ``grid`` stands for; None where it stands for none as it is."""
    volume_object: bpy.types.Object | None = scene.objects.get(grid.name)
    if not is_volume(volume_object) or resolution_of(volume_object) != tuple(grid.resolution):
        return None
    return read_edits(scene, volume_object)


def reset(scene: bpy.types.Scene, volume_object: bpy.types.Object, only: set[bpy.types.Object] | None = None) -> int:
    """Undoes what ``read_edits`` tells: moved probes return to their nodes and deleted ones come back.

    ``only`` restricts it to these probes. Returns how many changed.
    """
    edits = read_edits(scene, volume_object)
    if edits is None:
        return 0
    root = _find(scene, "")
    volume, record = _record_of(root, volume_object)
    grid = Grid(box_of(volume_object), resolution_of(volume_object), volume_object.name)
    if only is None:
        state = np.where(np.frombuffer(record["active"], np.uint8), ACTIVE, CULLED)
        place_probes(scene, grid, state, volume_object)
        return int((edits.disabled | edits.offset.any(axis=1)).sum())
    nodes = Grid(_placed_box(record), grid.resolution, volume_object.name).positions()
    moved = {
        probe[INDEX_PROPERTY]: probe
        for probe in only
        if probe.get(VOLUME_PROPERTY) == volume and edits.offset[probe[INDEX_PROPERTY]].any()
    }
    for index, probe in moved.items():
        if probe.parent is None:
            probe.location = nodes[index]
        else:
            probe.matrix_world.translation = nodes[index]
    return len(moved)


def any_placed(scene: bpy.types.Scene) -> bool:
    """Whether probes of some volume are placed, as objects or as points."""
    return _find(scene, "") is not None


def placed_count(scene: bpy.types.Scene, volume_object: bpy.types.Object) -> int | None:
    """How many probes were placed for a volume, as objects or as points; None where none are."""
    _, record = _record_of(_find(scene, ""), volume_object)
    return None if record is None else int(np.frombuffer(record["active"], np.uint8).sum())


def stand_elsewhere(scene: bpy.types.Scene, volume_object: bpy.types.Object) -> bool:
    """Whether the volume or its counts have changed since its probes were placed, so that these stand in the wrong
    places."""
    _, record = _record_of(_find(scene, ""), volume_object)
    if record is None:
        return False
    same = np.allclose(_placed_box(record), box_of(volume_object), rtol=0, atol=_MOVED)
    return not same or tuple(record["resolution"]) != resolution_of(volume_object)


def placed_points(scene: bpy.types.Scene) -> list[tuple[bpy.types.Object, np.ndarray]]:
    """Volumes whose probes are too many for objects, with world positions (N, 3) of their active nodes."""
    root = _find(scene, "")
    points = []
    for record in root.get(_RECORDS, {}).values() if root else ():
        volume_object = record.get("volume")
        if volume_object is None or tuple(record["resolution"]) != resolution_of(volume_object):
            continue
        active = np.frombuffer(record["active"], np.uint8).astype(bool)
        if active.sum() > OBJECT_LIMIT:
            grid = Grid(box_of(volume_object), resolution_of(volume_object), volume_object.name)
            points.append((volume_object, grid.positions()[active]))
    return points


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
    _forget(root, volume)
    for collection in [*root.children_recursive, root]:
        in_use = collection.all_objects or collection.children or len(collection.get(_RECORDS, {}))
        if _COLLECTION_MARK in collection and not in_use:
            bpy.data.collections.remove(collection)
    return len(gone)


def forget_lost_volumes(scene: bpy.types.Scene) -> None:
    """Removes probes of volumes that are gone, and of volumes whose name they no longer carry."""
    root = _find(scene, "")
    if root is None:
        return
    known = {name: record.get("volume") for name, record in root.get(_RECORDS, {}).items()}
    names = {probe[VOLUME_PROPERTY] for probe in root.all_objects if VOLUME_PROPERTY in probe} | set(known)
    for name in names:
        volume_object = known.get(name) or scene.objects.get(name)
        if volume_object is None or volume_object.name != name or volume_object.name not in scene.objects:
            clear_probes(scene, name)


def _placed_box(record) -> np.ndarray:
    """(4, 4) box of the volume when its probes were placed."""
    return np.frombuffer(record["matrix"], "<f8").reshape(4, 4).copy()


def _place_of(probe: bpy.types.Object) -> np.ndarray:
    """(3,) world position. An object's matrix is out of date between placing it and Blender's next evaluation."""
    free = probe.parent is None and not probe.constraints
    return np.array(probe.location if free else probe.matrix_world.translation, float)


def _remember(root, volume: str, volume_object, grid: Grid, active: np.ndarray) -> None:
    if _RECORDS not in root:
        root[_RECORDS] = {}
    root[_RECORDS][volume] = {
        "volume": volume_object,
        "resolution": [int(count) for count in grid.resolution],
        "matrix": grid.matrix.astype("<f8").tobytes(),
        "active": active.astype(np.uint8).tobytes(),
    }


def _forget(root: bpy.types.Collection, volume: str | None) -> None:
    records = root.get(_RECORDS, {})
    for name in [name for name in records.keys() if volume in (None, name)]:
        del records[name]


def _record_of(root: bpy.types.Collection | None, volume_object: bpy.types.Object):
    """(name, record) of what was placed for ``volume_object``, which may have been renamed since; (None, None)."""
    for name, record in root.get(_RECORDS, {}).items() if root else ():
        if record.get("volume") == volume_object:
            return name, record
    return None, None


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
