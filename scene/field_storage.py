# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked light inside the .blend.

A volume's field lies in a text datablock that the volume's Empty points to by its custom property ``gridlight_field``.
Texts are saved, appended and undone like anything else but never evaluated, so moving a volume does not copy its light
about. The text itself says in words what was baked; the numbers are its custom properties. Deleting the text, in
Blender's text editor or outliner, deletes the light.
"""

from __future__ import annotations

import json

import bpy
import numpy as np

from ..core.conventions import ACTIVE, DEPTH_EDGE
from ..core.depth_map import DEPTH_VALUES
from ..core.errors import InputError
from ..core.field import Field, state_counts
from ..core.gradients import gradient_bands
from ..core.grid import Grid
from ..core.probe_states import invalid_counts
from .volumes import box_of, resolution_of

POINTER = "gridlight_field"
_VERSION, _FORMAT_VERSION = "gridlight_version", 1
_NAME_BYTES = 40  # Blender cuts names at 63 bytes
# Per probe: shape behind the probe axis, by name of the field's attribute. -1: bands² coefficients; -2: those of them
# that have a gradient.
_ARRAYS = {
    "coefficients": ("<f4", (-1, 3)),
    "state": ("<u1", ()),
    "validity": ("<f4", ()),
    "offset": ("<f4", (3,)),
    "depth": ("<f4", (DEPTH_EDGE * DEPTH_EDGE, DEPTH_VALUES)),
    "gradient": ("<f4", (3, -2, 3)),
}
_KINDS = {"matrix": bytes, "bands": int, "metadata": str, "details": str, "state": bytes}  # of what panels show
_MOMENTS = 2  # of the depth's values, that is all that there was once
_SAME_PLACE = 1e-5  # of the box's size: what a transform may change by rounding


def store_field(volume_object: bpy.types.Object, field: Field, scene_hash: str, details: dict | None = None) -> None:
    """Keeps ``field`` as the light of ``volume_object``, instead of what it had.

    Args:
        scene_hash: of the scene that was baked (``formats.probe_metadata``); operators/stale.py compares it.
        details: what is worth knowing about this bake but does not belong into probe files, such as times; plain JSON.
    """
    text = stored_text(volume_object)
    if text is None or text.users > 1 or text.library:  # a copied volume shares its original's light until it is baked
        name = volume_object.name.encode()[:_NAME_BYTES].decode(errors="ignore")
        text = bpy.data.texts.new(f"Gridlight {name}")
        text.use_fake_user = False  # it goes with its volume
        volume_object[POINTER] = text
    for key in list(text.keys()):
        del text[key]  # bytes that are assigned to a property that holds some already end at their first zero
    metadata = {**field.metadata, "scene_hash": scene_hash}
    text[_VERSION] = _FORMAT_VERSION
    text["resolution"] = [int(count) for count in field.grid.resolution]
    text["matrix"] = field.grid.matrix.astype("<f8").tobytes()
    text["bands"] = field.bands
    text["metadata"] = json.dumps(metadata)
    text["details"] = json.dumps(details or {})
    text["invalid"] = json.dumps(invalid_counts([field]))
    for name, (kind, _) in _ARRAYS.items():
        text[name] = np.ascontiguousarray(getattr(field, name), kind).tobytes()
    text.from_string(_in_words(volume_object, field, metadata))


def load_field(volume_object: bpy.types.Object) -> Field | None:
    """The light that was baked for ``volume_object``, stale or not; None where there is none.

    Raises:
        InputError: the stored light is from a newer Gridlight or has been damaged.
    """
    text = stored_text(volume_object)
    if text is None:
        return None
    if reason := unreadable(volume_object):
        raise InputError(reason)
    grid = _stored_grid(text, volume_object.name)
    arrays = {}
    counts = {-1: text["bands"] ** 2, -2: gradient_bands(text["bands"]) ** 2}
    for name, (kind, shape) in _ARRAYS.items():
        if name == "gradient" and name not in text:
            continue  # stored before there were any
        values = np.frombuffer(text.get(name, b""), kind)
        shape = tuple(counts.get(size, size) for size in shape)
        if name == "depth" and len(values) == grid.count * DEPTH_EDGE**2 * _MOMENTS:
            shape = (DEPTH_EDGE**2, _MOMENTS)  # stored before what is in the middle was
        if len(values) != grid.count * int(np.prod(shape, initial=1)):
            raise InputError(f"the light stored for '{volume_object.name}' is damaged ({name}); bake the volume again")
        arrays[name] = values.reshape(grid.count, *shape).copy()
    return Field(grid, **arrays, metadata=json.loads(text["metadata"]))


def remove_field(volume_object: bpy.types.Object) -> None:
    """Forgets the light of ``volume_object``."""
    text = stored_text(volume_object)
    if POINTER in volume_object:
        del volume_object[POINTER]
    if text is not None and text.users == 0:
        bpy.data.texts.remove(text)


def stored_text(volume_object: bpy.types.Object) -> bpy.types.Text | None:
    """The text datablock that holds the light of ``volume_object``."""
    text = volume_object.get(POINTER)
    return text if isinstance(text, bpy.types.Text) and _VERSION in text else None


def unreadable(volume_object: bpy.types.Object) -> str:
    """In one line why the light that is stored for ``volume_object`` cannot be read; empty where it can, and where
    there is none. Panels rely on it: an exception in them comes with every redraw."""
    text = stored_text(volume_object)
    if text is None:
        return ""
    name, version = volume_object.name, text[_VERSION]
    if not isinstance(version, int) or version > _FORMAT_VERSION:
        return f"the light of '{name}' was stored by a newer Gridlight; update it, or bake the volume again"
    wrong = next((key for key, kind in _KINDS.items() if not isinstance(text.get(key), kind)), "")
    return f"the light stored for '{name}' is damaged ({wrong}); bake the volume again" if wrong else ""


def _readable_text(volume_object: bpy.types.Object) -> bpy.types.Text | None:
    return None if unreadable(volume_object) else stored_text(volume_object)


def stored_metadata(volume_object: bpy.types.Object) -> dict | None:
    """What is known about the light of ``volume_object`` without reading it: cheap enough for every redraw. None where
    there is none, or none that can be read."""
    text = _readable_text(volume_object)
    return json.loads(text["metadata"]) if text is not None else None


def stored_details(volume_object: bpy.types.Object) -> dict:
    """The ``details`` that were stored with the light; empty where there is none."""
    text = _readable_text(volume_object)
    return json.loads(text["details"]) if text is not None else {}


def stored_counts(volume_object: bpy.types.Object) -> dict[str, int] | None:
    """Number of probes of the baked grid: total, active, culled, invalid."""
    text = _readable_text(volume_object)
    if text is None:
        return None
    return state_counts(np.frombuffer(text.get("state", b""), np.uint8))


def stored_invalid(volume_object: bpy.types.Object) -> dict[str, int]:
    """Number of invalid probes by reason (core/probe_states.py); empty where there are none, or nobody noted why."""
    text = _readable_text(volume_object)
    return json.loads(text.get("invalid", "{}")) if text is not None else {}


def has_moved(volume_object: bpy.types.Object) -> bool:
    """Whether box or counts of ``volume_object`` are no longer those of its light. Without light: no."""
    text = _readable_text(volume_object)
    if text is None:
        return False
    grid = _stored_grid(text, volume_object.name)
    size = np.linalg.norm(grid.matrix[:3, :3])
    same_box = np.abs(grid.matrix - box_of(volume_object)).max() <= _SAME_PLACE * size
    return not (same_box and tuple(grid.resolution) == resolution_of(volume_object))


def _stored_grid(text: bpy.types.Text, name: str) -> Grid:
    matrix = np.frombuffer(text["matrix"], "<f8")
    if len(matrix) != 16:
        raise InputError(f"the light stored for '{name}' is damaged (matrix); bake the volume again")
    return Grid(matrix.reshape(4, 4).copy(), tuple(text["resolution"]), name)


def _in_words(volume_object: bpy.types.Object, field: Field, metadata: dict) -> str:
    counts = " × ".join(str(count) for count in field.grid.resolution)
    lines = [
        f"Light of the Gridlight volume '{volume_object.name}'.",
        f"{counts} probes, {int((field.state == ACTIVE).sum())} of them active, {field.bands} bands.",
        f"Baked by {metadata.get('generator', 'Gridlight')} on {metadata.get('device', 'an unknown device')}.",
        "The numbers are custom properties of this text. Deleting the text deletes the light.",
    ]
    return "\n".join(lines) + "\n"
