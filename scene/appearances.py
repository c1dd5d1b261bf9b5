# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material looks like, and to whom: most look the same to everybody; others have a front and a back (the
Geometry node's Backfacing), or cast another shadow than they show (the Light Path node)."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..core.kept import same
from ..core.snapshot import CAMERA_RAYS, DIFFUSE_RAYS, FROM_BEHIND, FROM_FRONT, SHADOW_RAYS
from .images import ImageTable
from .node_links import Unsupported, active_output, find_socket
from .notices import Notices
from .procedurals import sampler_of
from .ray_nodes import Viewer
from .shader_nodes import NodeEvaluator
from .shader_values import Value, constant
from .surface_parts import SurfaceParts
from .surface_shaders import DEFAULT_GREY, HOLE, Closure, evaluate_shader
from .surface_values import SurfaceEvaluator


@dataclass(frozen=True)
class Appearance:
    """``unseen_by``: who does not see it, see core.snapshot.Material."""

    closure: Closure
    unseen_by: int = 0


class AppearanceReader:
    """Reads materials; patterns that no UV map can carry lie on atlases of ``surfaces``, if there are any."""

    def __init__(self, images: ImageTable, notices: Notices, surfaces: SurfaceParts | None):
        self._images = images
        self._notices = notices
        self._surfaces = surfaces

    def of(self, material: bpy.types.Material) -> list[Appearance]:
        """All that ``material`` looks like: first its front as light that bounces sees it."""
        if material.node_tree is None or not material.use_nodes:
            return [Appearance(Closure(constant(material.diffuse_color[:3]), constant(1.0)))]  # type: ignore[index]
        output = active_output(material.node_tree, "ShaderNodeOutputMaterial")
        if output is None:
            self._notices.group("materials without an output node are black", material.name)
            return [Appearance(Closure())]
        surface, volume = (find_socket(output.inputs, name) for name in ("Surface", "Volume"))
        if volume.is_linked:
            self._notices.group("volume shaders are not supported", material.name)
            if not surface.is_linked:
                return [Appearance(HOLE)]
        try:
            return self._all(material, surface)
        except Unsupported as reason:
            self._notices.append(f"material '{material.name}': {reason}; default grey is used")
            return [Appearance(Closure(DEFAULT_GREY))]

    def _all(self, material: bpy.types.Material, surface: bpy.types.NodeSocket) -> list[Appearance]:
        """
        Raises:
            Unsupported: see ``evaluate_shader``.
        """
        front, asked = self._seen_by(Viewer(), material, surface)
        if not (asked.asks_side or asked.asks_kind):
            return [Appearance(front)]
        sides = [(front, 0)]
        if asked.asks_side:
            back = self._seen_by(Viewer(behind=True), material, surface)[0]
            if not same(front, back):
                sides = [(front, FROM_BEHIND), (back, FROM_FRONT)]
        if not asked.asks_kind:
            return [Appearance(*side) for side in sides]
        shadows = [
            (self._seen_by(Viewer(bool(unseen & FROM_FRONT), True), material, surface)[0], unseen)
            for _closure, unseen in sides
        ]
        if all(_dims_alike(closure, shadow) for (closure, _unseen), (shadow, _same) in zip(sides, shadows)):
            return [Appearance(*side) for side in sides]
        shown = [Appearance(closure, unseen | SHADOW_RAYS) for closure, unseen in sides]
        cast = [
            Appearance(Closure(opacity=shadow.opacity, tint=shadow.tint), unseen | DIFFUSE_RAYS | CAMERA_RAYS)
            for shadow, unseen in shadows
            if not (shadow.opacity.is_zero() and shadow.tint.is_one())
        ]
        return shown + cast

    def _seen_by(
        self, viewer: Viewer, material: bpy.types.Material, surface: bpy.types.NodeSocket
    ) -> tuple[Closure, NodeEvaluator]:
        """The closure at ``surface``: on UV maps where they can carry its pattern, else on an atlas of its own; and who
        knows what of the viewer was asked.

        Raises:
            Unsupported: see ``evaluate_shader``.
        """
        owner = f"material '{material.name}'"
        notices = Notices()
        evaluator = NodeEvaluator(owner, self._images, notices, material.name, sampler_of(material), viewer)
        closure = evaluate_shader(evaluator, surface)
        placed = {value.domain for value in _values(closure) if not value.is_constant}
        samples = None
        if evaluator.loses_pattern or len(placed) > 1:
            samples = self._surfaces.samples(material) if self._surfaces is not None else None
        if samples is not None:
            notices = Notices()
            closure = evaluate_shader(
                SurfaceEvaluator(owner, self._images, notices, material.name, material, samples, viewer), surface
            )
        self._notices.extend(notices)
        return closure, evaluator


def _values(closure: Closure) -> tuple[Value, ...]:
    return closure.diffuse, closure.through, closure.opacity, closure.emission, closure.tint


def _dims_alike(first: Closure, second: Closure) -> bool:
    """Whether both leave the same of light that falls through."""
    return same((first.opacity, first.tint), (second.opacity, second.tint))
