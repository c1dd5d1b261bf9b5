# SPDX-License-Identifier: GPL-3.0-or-later
"""Material datablocks to ``core.snapshot.Material``: one diffuse, emitting, possibly perforated surface each.

``surface_shaders`` says what each kind of shader becomes. Here the result is laid out for the bake: one texture mapping
per material (the base colour's, else the opacity's, else the emission's) and at most two textures.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy
import numpy as np

from ..core.gloss import Gloss
from ..core.light_links import UNLINKED, Links
from ..core.snapshot import DIFFUSE_RAYS, DITHERED, FROM_BEHIND, NO_IMAGE, Material
from .images import ImageTable
from .node_links import Unsupported, active_output, find_socket
from .notices import Notices
from .procedurals import sampler_of
from .shader_nodes import NodeEvaluator
from .shader_values import ONE, ZERO, Domain, Value, add, apply, complement, constant, multiply
from .surface_parts import SurfaceParts
from .surface_shaders import DEFAULT_GREY, HOLE, WHITE, Closure, evaluate_shader
from .surface_values import SurfaceEvaluator

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
        self._surfaces = surfaces
        self._indices: dict[tuple[int, Look], int] = {}

    def index(self, material: bpy.types.Material | None, look: Look = PLAIN) -> int:
        """Row of ``material`` on objects of that ``look``; None is Blender's default grey surface."""
        key = (material.as_pointer() if material is not None else 0, look)
        if key not in self._indices and look != PLAIN:
            own = self.index(material)
            row = self.materials[own]
            self._indices[key] = len(self.materials)
            factor = 0.0 if look.unseen_by & DIFFUSE_RAYS else look.intensity  # what no ray sees lights nothing
            emission = _three(value * factor for value in row.emission)
            unseen_by = row.unseen_by | look.unseen_by
            self.materials.append(replace(row, emission=emission, unseen_by=unseen_by, links=look.links))
            self.domains.append(self.domains[own])
        elif key not in self._indices:
            self._indices[key] = len(self.materials)
            if material is None:
                self._append("", Closure(DEFAULT_GREY), False)
            else:
                culls = bool(material.use_backface_culling)
                self._append(material.name, self._closure(material), culls)
        return self._indices[key]

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

    def _closure(self, material: bpy.types.Material) -> Closure:
        if material.node_tree is None or not material.use_nodes:
            return Closure(constant(material.diffuse_color[:3]), constant(1.0))  # type: ignore[index]
        output = active_output(material.node_tree, "ShaderNodeOutputMaterial")
        if output is None:
            self._notices.group("materials without an output node are black", material.name)
            return Closure()
        surface, volume = (find_socket(output.inputs, name) for name in ("Surface", "Volume"))
        if volume.is_linked:
            self._notices.group("volume shaders are not supported", material.name)
            if not surface.is_linked:
                return HOLE
        try:
            return self._evaluated(material, surface)
        except Unsupported as reason:
            self._notices.append(f"material '{material.name}': {reason}; default grey is used")
            return Closure(DEFAULT_GREY)

    def _evaluated(self, material: bpy.types.Material, surface: bpy.types.NodeSocket) -> Closure:
        """The closure at ``surface``: on UV maps where they can carry its pattern, else on an atlas of its own.

        Raises:
            Unsupported: see ``evaluate_shader``.
        """
        owner = f"material '{material.name}'"
        notices = Notices()
        evaluator = NodeEvaluator(owner, self._images, notices, material.name, sampler_of(material))
        closure = evaluate_shader(evaluator, surface)
        placed = {
            value.domain
            for value in (closure.diffuse, closure.through, closure.opacity, closure.emission, closure.tint)
            if not value.is_constant
        }
        samples = None
        if evaluator.loses_pattern or len(placed) > 1:
            samples = self._surfaces.samples(material) if self._surfaces is not None else None
        if samples is not None:
            notices = Notices()
            closure = evaluate_shader(
                SurfaceEvaluator(owner, self._images, notices, material.name, material, samples), surface
            )
        self._notices.extend(notices)
        return self._from_both_sides(closure, evaluator, surface) if evaluator.asks_side else closure

    def _from_both_sides(self, front: Closure, evaluator: NodeEvaluator, surface: bpy.types.NodeSocket) -> Closure:
        """``front`` with what is known of the back: that nothing is there."""
        behind = NodeEvaluator(evaluator.owner, self._images, Notices(), evaluator.owner_name, evaluator.sample)
        behind.behind = True
        back = evaluate_shader(behind, surface)
        if back.opacity.is_zero() and back.emission.is_zero() and front.emission.is_zero():
            return replace(front, one_sided=True)
        self._notices.group("surfaces show their front on both sides, whatever Backfacing asks", evaluator.owner_name)
        return front

    def _append(self, name: str, closure: Closure, backface_culling: bool) -> None:
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
                unseen_by=FROM_BEHIND if closure.one_sided else 0,
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
