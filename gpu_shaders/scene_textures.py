# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene snapshot as textures: hierarchy, triangles, materials, images and lights.

All positions are relative to an origin (the volume's centre), so a scene far from the world's origin loses nothing to
float32.
"""

from __future__ import annotations

import numpy as np

from ..core import bvh, emitters
from ..core.errors import InputError
from ..core.faint_gloss import faint_rows
from ..core.gloss import gloss_rows
from ..core.kept import Kept
from ..core.light_links import link_roles
from ..core.scene_changes import SceneChanges, ShapeChange, boxes_around
from ..core.sheets import sheet_numbers
from ..core.snapshot import Light, SceneSnapshot
from ..core.steps import Pace, Steps, run
from ..core.triangles import areas
from .dispatch import is_software
from .image_textures import kept_or_sent
from .lamp_rows import pack_lights, with_profiles
from .scatter import scatter_rows
from .textures import upload

_STACK_STEP = 8  # sizes of traversal stacks are multiples of it, so that most edits of a scene need no new shaders
_OF_MATERIALS = "materials", "sheets", "links", "tints", "gloss_rows", "faint_gloss", "emitters"
_MOST_TRIANGLES = 1 << 24  # their numbers are kept as float32, which knows every whole number up to here


class SceneTextures:
    """Everything that shaders read about the scene.

    ``defines`` are what every shader that touches surfaces must be compiled with; ``bind`` hands it the textures it
    declares.
    """

    def __init__(self, snapshot: SceneSnapshot, origin: np.ndarray, emitter_density: np.ndarray):
        """``origin`` (3,) world metres; ``emitter_density`` (T,) per m², from core/emitters.py.

        Raises:
            InputError: more triangles than the GPU can number.
        """
        run(self._fill(snapshot, origin, emitter_density, Pace(None)))

    @classmethod
    def make(
        cls, snapshot: SceneSnapshot, origin: np.ndarray, emitter_density: np.ndarray, pace: Pace
    ) -> Steps[SceneTextures]:
        """The same in steps."""
        scene = cls.__new__(cls)
        yield from scene._fill(snapshot, origin, emitter_density, pace)
        return scene

    def _fill(self, snapshot: SceneSnapshot, origin: np.ndarray, density: np.ndarray, pace: Pace) -> Steps[None]:
        if len(snapshot.triangles) > _MOST_TRIANGLES:
            raise InputError(
                f"scene '{snapshot.name}' has {len(snapshot.triangles)} triangles, {_MOST_TRIANGLES} is the most; hide "
                "objects from rendering or lower their subdivision"
            )
        self._origin = np.asarray(origin, float)
        self._textures: dict = {}
        corners = (snapshot.triangle_positions - self._origin).astype(np.float32)
        self._take_hierarchy(corners, (yield from pace.in_background(bvh.kept_or_built, corners)))
        yield
        rows = yield from pace.in_background(self._surface_rows, snapshot, density, slice(None))
        for name, values in rows.items():
            self._textures[name] = upload(values, name.replace("_", " "))
            yield
        self.has_images = bool(snapshot.images)
        if self.has_images:
            self._send_images(snapshot)
            yield
        self._suns = pack_lights([], self._origin)
        self.set_lights(snapshot.lights, self._origin)

    def update(self, snapshot: SceneSnapshot, changes: SceneChanges, emitter_density: np.ndarray | None) -> str:
        """Brings the textures from the snapshot before to ``snapshot`` and sends only what ``changes`` ask for. The
        density may be None where neither shape nor surfaces changed.

        Returns what became of the hierarchy: "kept", "refit" or "rebuilt". Triangles keep their numbers unless it is
        rebuilt.
        """
        hierarchy = "kept" if changes.shape is None else self._reshape(snapshot, changes.shape)
        groups = self._links.groups
        if hierarchy == "rebuilt" or changes.materials or changes.emission or changes.reflectance:
            assert emitter_density is not None
            self._send_surfaces(snapshot, emitter_density)
        elif changes.shape:
            assert emitter_density is not None
            order = self.hierarchy.order
            differs = changes.shape.where[order] | (emitter_density[order] != self._density)
            self._send_surfaces(snapshot, emitter_density, np.flatnonzero(differs))
        if changes.images:
            self._send_images(snapshot)
        if changes.any_light or groups != self._links.groups:
            self.set_lights(snapshot.lights, self._origin)
        return hierarchy

    def set_lights(self, lights: list[Light], origin: np.ndarray) -> None:
        """Other lamps for the same surfaces."""
        self.light_count = len(lights)
        self._lights = pack_lights(lights, origin)
        self._profiles = [light.profile for light in lights]
        self._groups = np.array([light.link_group for light in lights], np.int64)
        self._send_lights()

    def set_suns(self, suns: list[Light]) -> None:
        """Suns of the world, which light patches like lamps. They follow the lamps, so that pictures, which see the
        world through the field, count lamps only."""
        self._suns = pack_lights(suns, np.zeros(3))
        self._send_lights()

    def _send_lights(self) -> None:
        """Lamps, suns, and what nodes make of lamps' light."""
        rows = np.concatenate([self._lights, self._suns])
        known = self._groups <= self._links.groups  # others light everything that there is
        rows[: len(known), 4, 3] += 2 * self._groups * known
        self._textures["lights"] = upload(with_profiles(rows, self._profiles), "lights")

    def _build(self, snapshot: SceneSnapshot) -> None:
        corners = (snapshot.triangle_positions - self._origin).astype(np.float32)
        self._take_hierarchy(corners, bvh.build(corners))

    def _take_hierarchy(self, corners: np.ndarray, hierarchy: bvh.Hierarchy) -> None:
        """``hierarchy`` was built around ``corners`` (T, 3, 3)."""
        self.hierarchy = self._built = hierarchy
        self.corners = corners[hierarchy.order]
        self.triangle_count = len(corners)
        self._textures["bvh_nodes"] = upload(hierarchy.nodes, "hierarchy nodes")

    def _reshape(self, snapshot: SceneSnapshot, shape: ShapeChange) -> str:
        """Refits the hierarchy where that serves."""
        if shape.triangle_map is None:
            order = self.hierarchy.order
            corners = np.empty_like(self.corners)
            corners[order] = self.corners
            moved = snapshot.vertices[snapshot.triangles[shape.where]] - self._origin
            corners[shape.where] = moved.astype(np.float32)
            refitted, nodes = bvh.refit(self.hierarchy, corners, shape.where)
            if not bvh.stretched(refitted, self._built):
                self.hierarchy, self.corners = refitted, corners[order]
                scatter_rows(self._textures["bvh_nodes"], nodes, refitted.nodes[nodes])
                return "refit"
        self._build(snapshot)
        return "rebuilt"

    def _send_surfaces(self, snapshot: SceneSnapshot, density: np.ndarray, only: np.ndarray | None = None) -> None:
        """Materials, sheets, emitters, and corners and attributes of all triangles or of those at ``only`` (K,) in leaf
        order."""
        for name, values in self._surface_rows(snapshot, density, slice(None) if only is None else only).items():
            if only is None or name in _OF_MATERIALS:
                self._textures[name] = upload(values, name.replace("_", " "))
            elif len(only):
                scatter_rows(self._textures[name], only, values)

    def _surface_rows(self, snapshot: SceneSnapshot, density: np.ndarray, at) -> dict[str, np.ndarray]:
        """Textures' contents by name: materials, sheets, gloss, emitters, and corners and attributes of the triangles
        ``at`` in leaf order. Notes what of it decides about shaders."""
        order = self.hierarchy.order
        clips = np.array([m.alpha_threshold > 0 for m in snapshot.materials] or [False])
        unseen = np.array([m.unseen_by for m in snapshot.materials] or [0])
        tinted = np.array([m.is_tinted for m in snapshot.materials] or [False])
        self.has_alpha, self.has_unseen, self.has_tint = bool(clips.any()), bool(unseen.any()), bool(tinted.any())
        self._links = link_roles([m.links for m in snapshot.materials])
        sheet_of_material, sheets = sheet_numbers(snapshot.materials, self._links.of_surface)
        self.has_sheets = len(sheets) > 1
        self.has_gloss = any(material.gloss is not None for material in snapshot.materials)
        self.has_faint_gloss = any(material.faint_gloss is not None for material in snapshot.materials)
        self._density = density[order]
        self.emitter_count = int(np.count_nonzero(self._density))
        self.emitter_reach = emitters.reach(self._density)
        material = np.clip(snapshot.material_index[order[at]], 0, max(len(snapshot.materials) - 1, 0))
        corners = self.corners[at]
        rows = np.zeros((len(corners), 3, 4), np.float32)
        rows[:, :, :3] = corners
        rows[:, 0, 3] = self.hierarchy.leaf_end[at]
        roles = self._links.of_surface[material]
        # Bits, see ray_lib.
        rows[:, 1, 3] = clips[material] + 2 * unseen[material] + 64 * tinted[material] + 128 * roles
        rows[:, 2, 3] = sheet_of_material[material]
        attributes = _kept_attributes if len(corners) == len(order) else _attributes
        of_surface = snapshot.corner_normals, snapshot.corner_uvs, snapshot.object_index
        return {
            "materials": _materials(snapshot),
            "sheets": sheets.astype(np.float32),
            "links": self._links.rows(),
            "tints": _tints(snapshot),
            "gloss_rows": gloss_rows([material.gloss for material in snapshot.materials]),
            "faint_gloss": faint_rows([material.faint_gloss for material in snapshot.materials]),
            "emitters": _emitters(self._density, self.corners, order),
            "triangle_corners": rows,
            "triangle_attributes": attributes(*of_surface, order[at], material, corners, self._density[at]),
        }

    def _send_images(self, snapshot: SceneSnapshot) -> None:
        self.has_images = bool(snapshot.images)
        if self.has_images:
            self._images = kept_or_sent(snapshot.images)
            self._textures["image_table"], self._textures["image_texels"] = self._images.table, self._images.texels

    @property
    def surface_defines(self) -> dict:
        """For shaders that ask what surfaces are made of, and may trace rays."""
        stack_size = -(-self.hierarchy.stack_size // _STACK_STEP) * _STACK_STEP
        return {
            "HAS_ALPHA": self.has_alpha,
            "HAS_IMAGES": self.has_images,
            "HAS_FAINT_GLOSS": self.has_faint_gloss,
            "HAS_UNSEEN": self.has_unseen,
            "HAS_PROFILES": any(profile is not None for profile in self._profiles),
            "HAS_TINT": self.has_tint,
            "HAS_LINKS": self._links.groups > 0,
            "LINK_GROUPS": self._links.groups or None,
            "STACK_SIZE": stack_size,
            "LEAN_STACK": not is_software(),
        }

    @property
    def ray_defines(self) -> dict:
        """For shaders that only trace rays; images matter to them only where surfaces have holes."""
        return self.surface_defines | {"HAS_IMAGES": self.has_alpha and self.has_images, "HAS_FAINT_GLOSS": False}

    @property
    def light_defines(self) -> dict:
        """For shaders that light points: sampled emitters bring their materials along."""
        defines = self.surface_defines if self.emitter_count else self.ray_defines
        return defines | {"HAS_EMITTERS": self.emitter_count > 0}

    @property
    def sheet_defines(self) -> dict:
        """For shaders that light patches or find them."""
        return {"HAS_SHEETS": self.has_sheets}

    @property
    def path_defines(self) -> dict:
        """For shaders that follow light from surface to surface and light points there."""
        return self.light_defines | self.surface_defines | self.sheet_defines | self.gloss_defines

    @property
    def gloss_defines(self) -> dict:
        """For shaders that follow mirrored light or ask what is glossy."""
        return {"HAS_GLOSS": self.has_gloss}

    def bind_gloss(self, shader) -> None:
        """Binds what a shader compiled with ``gloss_defines`` declares beside surfaces and lights."""
        if self.has_gloss:
            self.bind(shader, "gloss_rows")

    def bind_mirrored_lights(self, shader) -> None:
        """Binds the lamps and sampled emitters of a shader that sees them mirrored and lights no diffuse points."""
        self.bind(shader, "lights")
        shader.uniform_int("light_count", (self.lamp_count,))
        if self.emitter_count:
            self.bind_emitters(shader)

    def bind_sheets(self, shader, numbers=None) -> None:
        """Binds what a shader compiled with ``sheet_defines`` declares; ``numbers``: sheets of patches or texels."""
        if self.has_sheets:
            self.bind(shader, "sheets")
            if numbers is not None:
                shader.uniform_sampler("sheet_numbers", numbers)

    def bind(self, shader, *names: str) -> None:
        for name in names:
            shader.uniform_sampler(name, self._textures[name])

    def bind_rays(self, shader) -> None:
        """Binds what a shader compiled with ``ray_defines`` and no surfaces declares."""
        self.bind(shader, "bvh_nodes", "triangle_corners")
        if self._links.groups:
            self.bind(shader, "links")
        if self.has_alpha:
            self.bind(shader, "triangle_attributes", "materials")
            if self.has_tint:
                self.bind(shader, "tints")
            if self.has_images:
                self.bind(shader, "image_table", "image_texels")

    @property
    def lamp_count(self) -> int:
        """Lamps and suns of the world."""
        return self.light_count + len(self._suns)

    def bind_lights(self, shader) -> None:
        """Binds what a shader compiled with ``light_defines`` declares: all lamps, suns and sampled emitters."""
        if self.emitter_count:
            self.bind_light_of_emitters(shader)
        else:
            self.bind_rays(shader)
        self.bind(shader, "lights")
        shader.uniform_int("light_count", (self.lamp_count,))

    def bind_lamps(self, shader) -> None:
        """Binds what a shader that lights points, compiled with ``ray_defines``, declares: no emitters."""
        self.bind_rays(shader)
        self.bind(shader, "lights")
        shader.uniform_int("light_count", (self.lamp_count,))

    def bind_light_of_emitters(self, shader) -> None:
        """Binds what a shader that lights points by sampled emitters declares, but lamps."""
        self.bind_surfaces(shader)
        self.bind_emitters(shader)
        shader.uniform_float("emitter_reach", self.emitter_reach)

    def bind_emitters(self, shader) -> None:
        self.bind(shader, "emitters")
        shader.uniform_int("emitter_count", (self.emitter_count,))

    def bind_surfaces(self, shader) -> None:
        """Binds what a shader compiled with ``surface_defines`` declares."""
        self.bind(shader, "bvh_nodes", "triangle_corners", "triangle_attributes", "materials")
        if self.has_tint:
            self.bind(shader, "tints")
        if self._links.groups:
            self.bind(shader, "links")
        if self.has_images:
            self.bind(shader, "image_table", "image_texels")
        if self.has_faint_gloss:
            self.bind(shader, "faint_gloss")


def _attributes(
    normals: np.ndarray,
    uvs: np.ndarray,
    objects: np.ndarray,
    order: np.ndarray,
    material: np.ndarray,
    corners: np.ndarray,
    density: np.ndarray,
) -> np.ndarray:
    """(T', 5, 4) rows of surface_lib's triangle_attributes.

    Args:
        normals, uvs, objects: of corners and of all T triangles, as snapshots have them.
        order: (T',) those that are asked for, in leaf order, as are the rest.
    """
    uvs = uvs[order].astype(np.float32)
    rows = np.zeros((len(order), 5, 4), np.float32)
    rows[:, 0:3, :3] = normals[order]
    rows[:, 0, 3] = material
    rows[:, 1, 3] = objects[order]
    rows[:, 2, 3] = _uv_scale(corners, uvs)
    rows[:, 3] = uvs[:, :2].reshape(-1, 4)
    rows[:, 4, :2] = uvs[:, 2]
    rows[:, 4, 2] = density
    rows[:, 4, 3] = order
    return rows


_kept_attributes = Kept(_attributes)


def _emitters(density: np.ndarray, corners: np.ndarray, order: np.ndarray) -> np.ndarray:
    """(E + 2·EMITTER_BOXES, 4) rows of emitter_lib's emitters and boxes around them, for triangles (T, 3, 3) in leaf
    ``order`` (T,) with ``density`` (T,).

    They stand in the snapshot's order: which point a random number picks then does not depend on the hierarchy."""
    triangle = np.flatnonzero(density > 0)
    triangle = triangle[np.argsort(order[triangle])]
    area = areas(corners[triangle].astype(np.float64))
    rows = np.zeros((len(triangle), 4), np.float32)
    rows[:, 0] = triangle
    rows[:, 1] = np.cumsum(density[triangle] * area)
    rows[:, 2] = density[triangle]
    parts = np.arange(len(triangle), dtype=np.float32) / np.float32(max(len(triangle), 1))
    rows[:, 3] = np.minimum(np.searchsorted(rows[:, 1], parts, side="right"), max(len(triangle) - 1, 0))
    boxes = np.zeros((emitters.EMITTER_BOXES, 2, 4), np.float32)
    found = boxes_around(corners[triangle], emitters.EMITTER_BOXES)
    boxes[..., :3] = np.resize(found, (emitters.EMITTER_BOXES, 2, 3)) if len(found) else 0.0
    return np.concatenate([rows, boxes.reshape(-1, 4)])


def _uv_scale(corners: np.ndarray, uvs: np.ndarray) -> np.ndarray:
    """(T,) uv units per metre: square root of the ratio of areas."""
    uv_edge = uvs[:, 1:] - uvs[:, :1]
    uv_area = np.abs(uv_edge[:, 0, 0] * uv_edge[:, 1, 1] - uv_edge[:, 0, 1] * uv_edge[:, 1, 0])
    return np.sqrt(uv_area / np.maximum(2 * areas(corners), 1e-30))


def _materials(snapshot: SceneSnapshot) -> np.ndarray:
    """(M, 3, 4) rows of surface_lib's materials."""
    rows = np.zeros((max(len(snapshot.materials), 1), 3, 4), np.float32)
    rows[:, 0] = (0.8, 0.8, 0.8, -1)
    rows[:, 1:, 3] = rows[:, 2, 2] = -1
    for row, material in zip(rows, snapshot.materials):
        row[0] = (*(np.array(material.base_color) * material.diffuse_share), material.base_image)
        row[1] = (*material.emission, material.emission_image)
        row[2] = (material.alpha, material.alpha_threshold, material.alpha_image, material.alpha_from_color)
    return rows


def _tints(snapshot: SceneSnapshot) -> np.ndarray:
    """(M, 4) elements of surface_lib's tints."""
    return np.array([(*m.tint, m.tint_image) for m in snapshot.materials] or [(1, 1, 1, -1)], np.float32)
