# SPDX-License-Identifier: GPL-3.0-or-later
"""Material datablocks to ``core.snapshot.Material``: one diffuse, emitting, possibly perforated surface each, or
several where not everybody sees the same.

``surface_shaders`` says what each kind of shader becomes, ``appearances`` who sees it. Here the result is laid out for
the bake: one texture mapping per material (the base colour's, else the opacity's, else the emission's) and at most two
textures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..core.gloss import Gloss
from ..core.light_links import UNLINKED, Links
from ..core.snapshot import DIFFUSE_RAYS, DITHERED, NO_IMAGE, Material
from .appearances import Appearance, AppearanceReader
from .images import ImageTable
from .notices import Notices
from .shader_values import ONE, ZERO, Domain, Value, add, apply, complement, constant, multiply
from .surface_parts import SurfaceParts
from .surface_shaders import DEFAULT_GREY, WHITE, Closure

_LEAST_OPACITY = 1e-3  # less is no surface, and what misses less than this of 1 is solid


@dataclass(frozen=True)
class Look:
    """What an object makes of its materials."""

    intensity: float = 1.0  # factor on emission
    unseen_by: int = 0  # see core.snapshot.Material
    links: Links = UNLINKED


PLAIN = Look()


class MaterialTable:
    """Reads materials on demand and keeps them in the order of ``SceneSnapshot.materials``."""

    def __init__(self, images: ImageTable, notices: Notices, surfaces: SurfaceParts | None = None):
        self.materials: list[Material] = []
        self.domains: list[Domain] = []  # the texture mapping of each material, to be applied to its corners' UVs
        self._images = images
        self._notices = notices
        self._appearances = AppearanceReader(images, notices, surfaces)
        self._indices: dict[tuple[int, Look], int] = {}
        self._coats: dict[int, list[int]] = {}

    def coats(self, index: int) -> list[int]:
        """Rows that the triangles of a material all show, each to others: its own row ``index``, and what it looks like
        from behind or to shadow rays where that is something else."""
        return self._coats.get(index, [index])

    def index(self, material: bpy.types.Material | None, look: Look = PLAIN) -> int:
        """Row of ``material`` on objects of that ``look``; None is Blender's default grey surface. See ``coats``."""
        key = (material.as_pointer() if material is not None else 0, look)
        if key not in self._indices and look != PLAIN:
            own = self.coats(self.index(material))
            self._start(key, len(own))
            factor = 0.0 if look.unseen_by & DIFFUSE_RAYS else look.intensity  # what no ray sees lights nothing
            for row, domain in [(self.materials[index], self.domains[index]) for index in own]:
                emission = _three(value * factor for value in row.emission)
                unseen_by = row.unseen_by | look.unseen_by
                self.materials.append(replace(row, emission=emission, unseen_by=unseen_by, links=look.links))
                self.domains.append(domain)
        elif key not in self._indices:
            appearances = [Appearance(Closure(DEFAULT_GREY))] if material is None else self._appearances.of(material)
            self._start(key, len(appearances))
            culls = material is not None and bool(material.use_backface_culling)
            for appearance in appearances:
                self._append("" if material is None else material.name, appearance, culls)
        return self._indices[key]

    def _start(self, key: tuple[int, Look], count: int) -> None:
        """The next ``count`` rows are those of ``key``."""
        first = self._indices[key] = len(self.materials)
        if count > 1:
            self._coats[first] = list(range(first, first + count))

    def is_hole(self, index: int) -> bool:
        """Whether nothing of the surface is left: light passes everywhere."""
        material = self.materials[index]
        opaque = material.alpha_image != NO_IMAGE or material.alpha >= _LEAST_OPACITY
        return not (opaque or material.is_tinted)

    def is_textured(self, index: int) -> bool:
        """Whether the surface samples any image."""
        material = self.materials[index]
        images = material.base_image, material.emission_image, material.alpha_image, material.tint_image
        return max(images) != NO_IMAGE

    def _append(self, name: str, appearance: Appearance, backface_culling: bool) -> None:
        closure = appearance.closure
        sent_back, transmitted = self._sent_back(name, closure)
        opacity, tint = _solid_where_opaque(closure.opacity), _white_where_clear(closure.tint)
        if tint is not WHITE and sent_back.is_zero() and closure.emission.is_zero():
            # What is black where it is no hole lets all light through, and leaves less of it.
            opacity, tint = ZERO, multiply(tint, complement(opacity))
        placed = [
            value
            for value in (sent_back, opacity, closure.emission, tint)
            if not value.is_constant and value.domain.uv_map is not None
        ]
        domain = placed[0].domain if placed else Domain()
        diffuse, opacity, emission, tint = (
            self._in_domain(name, role, value, domain)
            for role, value in (
                ("base colour", sent_back),
                ("alpha", opacity),
                ("emission", closure.emission),
                ("transparency", tint),
            )
        )
        if opacity.is_constant and opacity.number() < _LEAST_OPACITY and not emission.is_zero():
            self._notices.group("emission on a transparent surface is kept and the surface blocks light", name)
            diffuse, opacity = constant([0.0, 0.0, 0.0]), ONE

        if np.any(emission.scale < 0):
            self._notices.group("materials of negative emission take light away, as in Cycles", name)
        base_image, alpha_image = self._base_images(name, diffuse, opacity)
        self.domains.append(domain)
        self.materials.append(
            Material(
                name=name,
                base_color=_color(diffuse),
                emission=_three(np.broadcast_to(emission.scale, 3)),
                base_image=base_image,
                alpha_image=alpha_image,
                emission_image=NO_IMAGE if emission.is_constant else self._add(f"{name} emission", emission, None),
                alpha=opacity.number() if opacity.is_constant else 1.0,
                alpha_threshold=0.0 if opacity.is_constant and opacity.number() > 1 - _LEAST_OPACITY else DITHERED,
                tint=_color(tint),
                tint_image=NO_IMAGE if tint.is_constant else self._add(f"{name} tint", tint, None),
                transmitted=transmitted,
                **self._gloss(name, closure, sent_back, any(transmitted)),
                unseen_by=appearance.unseen_by,
                backface_culling=backface_culling,
            )
        )

    def _sent_back(self, name: str, closure: Closure) -> tuple[Value, tuple[float, float, float]]:
        """What the surface sends on either side of what arrives, and the share of it that has gone through."""
        if closure.through.is_zero():
            return closure.diffuse, (0.0, 0.0, 0.0)
        if closure.diffuse.is_zero():
            return closure.through, (1.0, 1.0, 1.0)
        one_pattern = (
            closure.diffuse.pixels is closure.through.pixels and closure.diffuse.domain == closure.through.domain
        )
        if not one_pattern:
            self._notices.group("where translucency changes over a surface its mean share is used", name)
        whole = add(closure.diffuse, closure.through)
        mean = np.maximum(np.broadcast_to(whole.mean(), 3), 1e-9)
        return whole, _three(np.clip(np.broadcast_to(closure.through.mean(), 3) / mean, 0.0, 1.0))

    def _gloss(self, name: str, closure: Closure, sent_back: Value, lets_through: bool) -> dict[str, Gloss | None]:
        gloss, is_faint = closure.mirrored.gloss(sent_back), closure.mirrored.is_faint(sent_back)
        if lets_through:
            if not is_faint:
                self._notices.group("gloss of translucent materials is sent in all directions", name)
            return {}
        return {"faint_gloss" if is_faint else "gloss": gloss}

    def _in_domain(self, name: str, role: str, value: Value, domain: Domain) -> Value:
        """``value`` as it can be sampled with the material's one mapping: textures that lie elsewhere become their
        mean.
        """
        if value.is_constant or value.domain == domain:
            return value
        if value.domain.uv_map is not None:
            self._notices.append(f"material '{name}': the {role} texture has a mapping of its own; its mean is used")
        return constant(value.mean())

    def _base_images(self, name: str, diffuse: Value, opacity: Value) -> tuple[int, int]:
        """(base image, alpha image): one image for both where they come from one."""
        if opacity.is_constant:
            return (NO_IMAGE if diffuse.is_constant else self._add(name, diffuse, None)), NO_IMAGE
        whole = self._images.whole(opacity.pixels)
        if (
            whole is not None
            and float(opacity.scale[0]) == 1
            and (diffuse.is_constant or self._images.whole(diffuse.pixels) is whole)
        ):
            index = self._images.add(name, whole, opacity.domain.extension)
            return (NO_IMAGE if diffuse.is_constant else index), index
        if diffuse.is_constant:
            return NO_IMAGE, self._add(
                f"{name} alpha", Value(np.ones(3, np.float32), np.ones_like(opacity.pixels), opacity.domain), opacity
            )
        index = self._add(name, diffuse, opacity)
        return index, index

    def _add(self, name: str, color: Value, opacity: Value | None) -> int:
        """Store the pixels of ``color``, without its factor, with ``opacity`` as alpha channel."""
        whole = self._images.whole(color.pixels) if opacity is None else None
        if whole is None:
            whole = _rgba(color, opacity)
        return self._images.add(name, whole, color.domain.extension)


def apply_domain(domain: Domain, corner_uvs: np.ndarray) -> np.ndarray:
    """``corner_uvs`` (T, 3, 2) through the domain's texture mapping, float32."""
    matrix = np.array(domain.matrix).reshape(2, 3)
    if np.array_equal(matrix, np.eye(2, 3)):
        return corner_uvs
    return (corner_uvs @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32)


def _solid_where_opaque(opacity: Value) -> Value:
    """Constant 1 for an alpha texture without holes, so that nobody samples it."""
    if not opacity.is_constant and opacity.least() > 1 - _LEAST_OPACITY:
        return ONE
    return opacity


def _white_where_clear(tint: Value) -> Value:
    """White for holes that colour nothing, so that nobody asks them."""
    return WHITE if tint.least() > 1 - _LEAST_OPACITY else tint


def _color(value: Value) -> tuple[float, float, float]:
    """The constant factor of a colour; negative reflectances do not exist on a surface."""
    return _three(np.maximum(np.broadcast_to(value.scale, 3), 0.0))


def _three(values) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def _rgba(color: Value, opacity: Value | None) -> np.ndarray:
    """(height, width, 4) float32: the pixels of ``color`` without its factor, ``opacity`` as alpha."""

    def join(rgb, alpha):
        shape = np.broadcast_shapes(rgb.shape[:2], alpha.shape[:2])
        return np.concatenate(
            [np.broadcast_to(np.maximum(rgb, 0), (*shape, 3)), np.broadcast_to(alpha, (*shape, 1))], axis=-1
        )

    unscaled = Value(np.ones(1, np.float32), color.pixels, color.domain)
    return apply(join, unscaled, ONE if opacity is None else opacity).pixels
