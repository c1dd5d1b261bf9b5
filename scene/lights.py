# SPDX-License-Identifier: GPL-3.0-or-later
"""Light objects to ``core.snapshot.Light``, in its units.

Factors as Cycles applies them: colour × temperature tint × 2^exposure × power, then per type. Nodes of a light multiply
on top.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core.light_profiles import LightProfile
from ..core.snapshot import Light
from .images import ImageTable
from .light_flux import known_profile, measured_profile
from .node_links import active_output, find_socket
from .notices import Notices
from .shader_nodes import NodeEvaluator
from .surface_shaders import evaluate_shader

_LEAST_SHEAR = 1e-5
_LEAST_VOLUME = 1e-6  # of the parallelepiped of three unit axes: less is flat
_FEW_BOUNCES = 12  # fewer can be told from light that bounces until it is gone

ROLE_PROPERTY, GROUP_PROPERTY, INTENSITY_PROPERTY = "gridlight_role", "gridlight_group", "gridlight_intensity"


class LightTable:
    """Collects lights; every instance of a light object is a light of its own."""

    def __init__(self, images: ImageTable, notices: Notices, measures: bool = True):
        """``measures``: nodes without a counterpart may be rendered; else what was last found of them is used."""
        self._measures = measures
        self.lights: list[Light] = []
        self._images = images
        self._notices = notices

    def add(self, item: bpy.types.Object, matrix: np.ndarray, name: str, link_group: int = 0) -> None:
        """Add light object ``item`` of a group of ``core.light_links``, placed by ``matrix`` (4, 4) float64, which for
        instances differs from its own.

        Lights that add nothing to diffuse light are passed over: portals, those without power, those invisible to
        diffuse rays.
        """
        light = _read_light(item, matrix, name, link_group, *self._node_tint(item.data), self._notices)
        if light is not None:
            self.lights.append(light)

    def _node_tint(self, data: bpy.types.Light) -> tuple[np.ndarray, LightProfile | None]:
        """(3,) factor of the light's shader nodes, averaged over its surface, and what they do beyond that."""
        if not data.use_nodes or data.node_tree is None:
            return np.ones(3), None
        output = active_output(data.node_tree, "ShaderNodeOutputLight")
        if output is None:
            return np.zeros(3), None
        notices = Notices()
        evaluator = NodeEvaluator(f"light '{data.name}'", self._images, notices, data.name)
        emission = evaluate_shader(evaluator, find_socket(output.inputs, "Surface")).emission
        if data.type != "SUN" and (evaluator.loses_pattern or not emission.is_constant):
            profile = measured_profile(data) if self._measures else known_profile(data)
            if profile is not None:
                return np.ones(3), profile
        self._notices.extend(notices)
        if not emission.is_constant:
            self._notices.append(f"light '{data.name}': the texture on it is not supported; its mean colour is used")
        return emission.rgb(), None


def _read_light(item, matrix, name, link_group, node_tint, profile, notices) -> Light | None:
    data = item.data
    if not item.visible_diffuse or (data.type == "AREA" and data.cycles.is_portal):
        return None
    color = np.array(data.color, float) * data.energy * 2.0**data.exposure * node_tint
    color *= float(item.get(INTENSITY_PROPERTY, 1.0))
    if data.use_temperature:
        color *= np.array(data.temperature_color, float)
    frame, scale = _cone_frame(matrix) if data.type == "SPOT" else _frame(matrix)
    if not (np.isfinite(color).all() and np.isfinite(frame).all()):
        notices.append(f"light '{name}' has a power that is not finite: it is left out")
        return None
    if not color.any():
        return None
    if (color < 0).any():
        notices.append(f"light '{name}' has negative power: it takes light away, as in Cycles")
    values = {
        "name": name,
        "kind": data.type,
        "matrix": frame,
        "casts_shadow": bool(data.use_shadow),
        "dynamic": is_dynamic(item),
        "group": str(item.get(GROUP_PROPERTY, "")),
        "profile": profile,
        "link_group": link_group,
    }
    kind = _KINDS[data.type](data, scale)
    values["color"] = tuple(float(value) for value in color * kind.pop("unit"))
    if data.cycles.max_bounces < _FEW_BOUNCES:
        notices.group("lights whose bounces are limited bounce on here", name)
    return Light(**values, **kind)


def is_dynamic(item: bpy.types.Object) -> bool:
    """Whether the light may move or change between frames: marked so by its role, or animated itself or by a parent."""
    if item.get(ROLE_PROPERTY) == "dynamic":
        return True
    if is_animated(item.data) or is_animated(item.data.node_tree):
        return True
    while item is not None:
        if is_animated(item) or any(not constraint.mute for constraint in item.constraints):
            return True
        item = item.parent
    return False


def is_animated(block: bpy.types.ID | None) -> bool:
    """Whether a datablock has an animation of its own."""
    animation = getattr(block, "animation_data", None)  # not all kinds of data can have one
    return animation is not None and bool(animation.action or animation.drivers or animation.nla_tracks)


def _frame(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The orthonormal frame of ``matrix`` (4, 4) and its scale (3,)."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    frame = matrix.copy()
    frame[:3, :3] /= np.where(scale > 0, scale, 1.0)
    return frame, scale


def _cone_frame(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for cones, which live in the coordinates of their object: where those are sheared, rows of the inverse
    and not axes tell what a direction is in them."""
    frame, scale = _frame(matrix)
    sheared = np.abs(frame[:3, :3].T @ frame[:3, :3] - np.eye(3)).max() > _LEAST_SHEAR
    if sheared and (scale > 0).all() and abs(np.linalg.det(frame[:3, :3])) > _LEAST_VOLUME:
        rows = np.linalg.inv(matrix[:3, :3])
        length = np.linalg.norm(rows, axis=1)
        frame[:3, :3], scale = (rows / length[:, None]).T, 1 / length
    return frame, scale


def _point(data, _scale) -> dict:
    # Without normalisation the sphere's radiance is energy/π whatever its size; one of radius 0 has that as its
    # intensity.
    radius = float(data.shadow_soft_size)
    if data.normalize:
        unit = 1 / (4 * np.pi)
    else:
        unit = radius**2 if radius > 0 else 1 / np.pi
    return {"unit": unit, "radius": radius, "soft_falloff": bool(data.use_soft_falloff)}


def _spot(data, scale) -> dict:
    return {
        **_point(data, scale),
        "spot_size": float(data.spot_size),
        "spot_blend": float(data.spot_blend),
        "spot_scale": tuple(float(value) for value in np.where(scale > 0, scale, 1.0)),
    }


def _sun(data, _scale) -> dict:
    # Without normalisation the strength is the radiance of a disc of this apparent size, so the irradiance grows with
    # it.
    unit = 1.0 if data.normalize or data.angle <= 0 else np.pi * np.sin(data.angle / 2) ** 2
    return {"unit": unit, "angle": float(data.angle)}


def _area(data, scale) -> dict:
    size_x = float(data.size)
    size_y = float(data.size_y) if data.shape in ("RECTANGLE", "ELLIPSE") else size_x
    size_x, size_y = size_x * float(scale[0]), size_y * float(scale[1])
    shape = "ELLIPSE" if data.shape in ("DISK", "ELLIPSE") else "RECTANGLE"
    area = size_x * size_y * (np.pi / 4 if shape == "ELLIPSE" else 1.0)
    unit = 1 / np.pi if not data.normalize else 1 / (np.pi * area) if area > 0 else 0.0
    return {"unit": unit, "shape": shape, "size_x": size_x, "size_y": size_y, "spread": float(data.spread)}


_KINDS = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
