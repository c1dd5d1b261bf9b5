# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs between two snapshots of one scene, in the terms of what a relight has to do about it.

Lights are compared by their place in the list, because it decides their random numbers. Materials are compared by
what triangles are made of, so a list in another order is no change. Objects are matched by name; of an object whose
number of triangles changed, the old one left and a new one came. All comparisons are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from .bvh import morton_codes
from .snapshot import NO_IMAGE, Image, Light, Material, SceneSnapshot, World
from .triangles import bounds

MOST_BOXES = 32  # around what changed, on each side; more follow the shape closer and cost more per texel
# What surfaces are: where it is the very same data, nothing of it need be compared.
_SURFACES = (
    "vertices",
    "triangles",
    "corner_normals",
    "corner_uvs",
    "material_index",
    "object_index",
    "object_names",
    "materials",
    "images",
)
_LIGHT_LABELS = {"name", "group", "dynamic"}  # say nothing about the light itself
_LIGHT_SHADES = {"color", "spot_blend", "profile"}  # where these differ, shadows stay what they are


@dataclass(frozen=True)
class ShapeChange:
    """Triangles that moved, deformed, got other normals, are seen by other rays, came or left.

    ``old_boxes`` (K, 2, 3) and ``new_boxes`` (K, 2, 3) are world-space corners (low, high), metres, which contain all
    such triangles before and after, K ≤ MOST_BOXES each. ``where`` (T,) bool are those of the newer snapshot.
    ``triangle_map`` (T,) int64 is the old triangle for each new one, −1 where there was none; None where the triangles
    are the same in the same order, so that a hierarchy can be refitted.
    """

    changed: tuple[str, ...]  # names of objects
    added: tuple[str, ...]
    removed: tuple[str, ...]
    old_boxes: np.ndarray
    new_boxes: np.ndarray
    where: np.ndarray
    triangle_map: np.ndarray | None

    @property
    def only_order(self) -> bool:
        """Are these the same triangles under other numbers?"""
        return not (len(self.old_boxes) or len(self.new_boxes))


@dataclass(frozen=True)
class SceneChanges:
    """From one snapshot to the next. T triangles and L lights of the newer one."""

    lights: np.ndarray  # (L,) bool: not what was at this place of the list before
    lights_removed: int  # places at the end of the old list that are gone
    lights_moved: tuple[str, ...]  # names of changed lights whose shadows may differ
    world: bool
    emission: bool
    reflectance: bool
    materials: bool  # rows of materials, images or their numbers must be sent again, even if nothing looks different
    images: bool
    shape: ShapeChange | None  # None: the same triangles in the same order

    @property
    def any_light(self) -> bool:
        """Is another lamp list needed?"""
        return bool(self.lights.any()) or self.lights_removed > 0

    @property
    def nothing(self) -> bool:
        """Is every result the same as before?"""
        same_shape = self.shape is None or self.shape.only_order
        return same_shape and not (self.any_light or self.world or self.emission or self.reflectance)

    def describe(self) -> list[str]:
        """One plain phrase per kind of change, for reports."""
        lines = []
        if self.any_light:
            count = int(self.lights.sum()) + self.lights_removed
            moved = f", {len(self.lights_moved)} of them moved" if self.lights_moved else ""
            lines.append(f"{count} lights changed{moved}")
        for differs, what in ((self.world, "world"), (self.emission, "emission"), (self.reflectance, "reflectance")):
            if differs:
                lines.append(f"{what} changed")
        if self.shape:
            for names, what in (
                (self.shape.changed, "changed shape or place"),
                (self.shape.added, "came"),
                (self.shape.removed, "left"),
            ):
                if names:
                    shown = ", ".join(f"'{name}'" for name in names[:3]) + (" and others" if len(names) > 3 else "")
                    lines.append(f"{len(names)} objects {what}: {shown}")
        return lines or ["nothing changed"]


def compare(old: SceneSnapshot, new: SceneSnapshot) -> SceneChanges:
    """What has changed from ``old`` to ``new``. Volumes, camera and frame do not count: they give no light."""
    lights = np.array(
        [i >= len(old.lights) or _differs(old.lights[i], light) for i, light in enumerate(new.lights)], bool
    )
    of_lights = SceneChanges(
        lights=lights,
        lights_removed=max(len(old.lights) - len(new.lights), 0),
        lights_moved=tuple(_moved_lights(old.lights, new.lights, lights)),
        world=_differs(old.world, new.world),
        emission=False,
        reflectance=False,
        materials=False,
        images=False,
        shape=None,
    )
    if all(getattr(old, name) is getattr(new, name) for name in _SURFACES):  # a lamp that moves in a large scene
        return of_lights
    triangle_map = _match_triangles(old, new)
    common = _common_triangles(triangle_map, len(new.triangles))
    images = _image_map(old.images, new.images)
    before, after = _material_aspects(old.materials, None), _material_aspects(new.materials, images)
    differs = _triangles_differ(old, new, common, before, after)
    shapes_differ = _shapes_differ(old, new, common)
    for aspect in _REBUILDING:
        shapes_differ = shapes_differ | differs[aspect]
    rows_differ = before != after
    images_differ = len(old.images) != len(new.images) or any(i != j for i, j in enumerate(images))
    numbers_differ = triangle_map is None and not np.array_equal(old.material_index, new.material_index)
    return replace(
        of_lights,
        emission=bool(differs["emission"].any()),
        reflectance=bool(differs["reflectance"].any()),
        materials=rows_differ or images_differ or numbers_differ,
        images=images_differ,
        shape=_shape_change(old, new, triangle_map, common, shapes_differ),
    )


def _differs(a: Light | World, b: Light | World, ignored: frozenset | set = frozenset()) -> bool:
    """Do two records differ in a field that is not ``ignored`` and is no mere label?"""
    skipped = _LIGHT_LABELS | ignored
    return any(not _same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a) if f.name not in skipped)


def _same(a, b) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


def _moved_lights(old: list[Light], new: list[Light], changed: np.ndarray):
    for index in np.flatnonzero(changed):
        if index >= len(old) or _differs(old[index], new[index], _LIGHT_SHADES):
            yield new[index].name


# Objects and triangles
# ---------------------------------------------------------------------------------------------------------------------


def _match_triangles(old: SceneSnapshot, new: SceneSnapshot) -> np.ndarray | None:
    """(T,) old triangle of each new one, −1 for none; None where all are the same in the same order."""
    if old.object_names == new.object_names and np.array_equal(old.object_index, new.object_index):
        return None
    old_order, old_start, old_count = _by_object(old)
    new_order, new_start, new_count = _by_object(new)
    partner = np.full(len(new.object_names), -1)
    places = {name: i for i, name in enumerate(_numbered(old.object_names))}
    for index, name in enumerate(_numbered(new.object_names)):
        found = places.get(name, -1)
        if found >= 0 and old_count[found] == new_count[index]:
            partner[index] = found
    item = new.object_index[new_order]
    place = np.arange(len(new_order)) - new_start[item]
    matched = partner[item] >= 0
    result = np.full(len(new.triangles), -1, np.int64)
    result[new_order[matched]] = old_order[old_start[partner[item[matched]]] + place[matched]]
    return result


def _by_object(snapshot: SceneSnapshot) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles sorted by object, and start and number of each object's in that order."""
    order = np.argsort(snapshot.object_index, kind="stable")
    count = np.bincount(snapshot.object_index, minlength=len(snapshot.object_names))
    return order, np.cumsum(count) - count, count


def _numbered(names: list[str]) -> list[tuple[str, int]]:
    """Names with how often each came before: instances of one object share a name."""
    seen: dict[str, int] = {}
    result = []
    for name in names:
        result.append((name, seen.get(name, 0)))
        seen[name] = result[-1][1] + 1
    return result


def _common_triangles(triangle_map: np.ndarray | None, count: int) -> tuple[np.ndarray | slice, np.ndarray | slice]:
    """Index of the matched triangles in the old and in the new snapshot."""
    if triangle_map is None:
        return slice(0, count), slice(0, count)
    after = np.flatnonzero(triangle_map >= 0)
    return triangle_map[after], after


def _shapes_differ(old: SceneSnapshot, new: SceneSnapshot, common) -> np.ndarray:
    """(C,) bool of the matched triangles: other corners or other normals?"""
    before, after = common
    normals = _rows_differ(old.corner_normals, new.corner_normals, common)
    if len(old.vertices) == len(new.vertices) and _same(old.triangles[before], new.triangles[after]):
        moved = (old.vertices != new.vertices).any(axis=1)
        return moved[new.triangles[after]].any(axis=1) | normals if moved.any() else normals
    corners = old.vertices[old.triangles[before]] != new.vertices[new.triangles[after]]
    return corners.any(axis=(1, 2)) | normals


def _rows_differ(old: np.ndarray, new: np.ndarray, common) -> np.ndarray:
    before, after = common
    if _same(old[before], new[after]):
        return np.zeros(len(new[after]), bool)
    return (old[before] != new[after]).any(axis=(1, 2))


def _shape_change(old, new, triangle_map, common, differs: np.ndarray) -> ShapeChange | None:
    """``differs`` (C,) bool of the matched triangles."""
    before, after = common
    old_gone, new_here = np.zeros(len(old.triangles), bool), np.zeros(len(new.triangles), bool)
    old_gone[before], new_here[after] = differs, differs
    changed = np.unique(new.object_index[new_here])
    added = removed = np.empty(0, np.int64)
    if triangle_map is not None:
        fresh = triangle_map < 0
        left = np.ones(len(old.triangles), bool)
        left[before] = False
        new_here |= fresh
        old_gone |= left
        added, removed = np.unique(new.object_index[fresh]), np.unique(old.object_index[left])
    if triangle_map is None and not differs.any():
        return None
    return ShapeChange(
        tuple(new.object_names[i] for i in changed),
        tuple(new.object_names[i] for i in added),
        tuple(old.object_names[i] for i in removed),
        boxes_around(old.vertices[old.triangles[old_gone]]),
        boxes_around(new.vertices[new.triangles[new_here]]),
        new_here,
        triangle_map,
    )


def boxes_around(triangles: np.ndarray, most: int = MOST_BOXES) -> np.ndarray:
    """(K, 2, 3) boxes (low, high), at most ``most``, that together contain ``triangles`` (T, 3, 3): equal parts along a
    space-filling curve."""
    if not len(triangles):
        return np.empty((0, 2, 3))
    low, high = bounds(triangles)
    order = np.argsort(morton_codes((low + high) / 2), kind="stable")
    count = min(most, len(order))
    starts = np.arange(count) * len(order) // count
    return np.stack([np.minimum.reduceat(low[order], starts), np.maximum.reduceat(high[order], starts)], axis=1)


# Materials
# ---------------------------------------------------------------------------------------------------------------------


def _image_map(old: list[Image], new: list[Image]) -> list[int]:
    """For each new image the old one with the same content; new numbers after the old ones where there is none."""
    result = []
    for index, image in enumerate(new):
        order = sorted(range(len(old)), key=lambda i: i != index)  # most likely where it was
        equal = (i for i in order if old[i].extension == image.extension and _same(old[i].pixels, image.pixels))
        result.append(next(equal, len(old) + index))
    return result


def _material_aspects(materials: list[Material], images: list[int] | None) -> list[dict]:
    """What each material does to light, one comparable value per aspect; ``images`` renumbers images."""

    def image(index):
        return index if index == NO_IMAGE or images is None else images[index]

    return [
        {
            "reflectance": (*(c * m.diffuse_share for c in m.base_color), image(m.base_image), m.gloss, m.faint_gloss),
            "emission": (*m.emission, image(m.emission_image)),
            "holes": (m.alpha, m.alpha_threshold, image(m.alpha_image), m.alpha_from_color)
            if m.alpha_threshold > 0
            else (),
            "tints": (m.tint, image(m.tint_image)) if m.is_tinted else (),
            "visibility": (m.unseen_by, m.links),
            "sheets": m.transmitted if any(m.transmitted) else (),
        }
        for m in materials
    ]


_ASPECT_IMAGES = {
    "reflectance": "base_image",
    "emission": "emission_image",
    "holes": "alpha_image",
    "tints": "tint_image",
    "sheets": "base_image",
    "visibility": None,
}
_REBUILDING = ("holes", "tints", "sheets", "visibility")  # where these differ, rays and patches find another surface


def _triangles_differ(old, new, common, before: list[dict], after: list[dict]) -> dict[str, np.ndarray]:
    """Per aspect (C,) bool of the matched triangles: another material, or other texture coordinates of a textured
    one?"""
    old_index, new_index = old.material_index[common[0]], new.material_index[common[1]]
    uvs = _rows_differ(old.corner_uvs, new.corner_uvs, common)
    result = {}
    for aspect, attribute in _ASPECT_IMAGES.items():
        numbers: dict[tuple, int] = {}
        old_value, new_value = (
            np.array([numbers.setdefault(row[aspect], len(numbers)) for row in rows] or [-1])
            for rows in (before, after)
        )
        textured = np.array(
            [
                attribute is not None and row[aspect] != () and getattr(m, attribute) != NO_IMAGE
                for row, m in zip(after, new.materials)
            ]
            or [False]
        )
        result[aspect] = (old_value[old_index] != new_value[new_index]) | (uvs & textured[new_index])
    return result
