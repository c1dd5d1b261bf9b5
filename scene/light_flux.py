# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes of a light that have no counterpart here (IES profiles, textures, falloffs) make of its power: Cycles
lights a white shell around it, with the nodes and without."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.panorama import project_panorama
from .cycles_reference import panoramic_camera, unbiased_settings
from .temporary import leave_nothing_behind, new_camera, plain_render_settings, render_pixels

_WIDTH, _SAMPLES = 64, 16
_RADIUS_M = 1.0  # of the shell, for lamps smaller than a tenth of it
_SIZES = 10.0  # of larger lamps, in its radius

_known: dict[int, np.ndarray] = {}  # by the light's session_uid, for those who must not render


def measured_tint(data: bpy.types.Light) -> np.ndarray:
    """(3,) mean of the light's nodes over its directions, at a metre or farther where it is large; not for suns."""
    with leave_nothing_behind():
        with_nodes = data.copy()
        with_nodes.color, with_nodes.energy, with_nodes.exposure = (1.0, 1.0, 1.0), 100.0, 0.0
        with_nodes.use_temperature = False
        plain = with_nodes.copy()
        tree = plain.node_tree
        tree.nodes.clear()
        glow, target = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputLight")
        glow.inputs["Color"].default_value, glow.inputs["Strength"].default_value = (1.0, 1.0, 1.0, 1.0), 1.0
        tree.links.new(glow.outputs[0], target.inputs["Surface"])
        flux = [_received(light) for light in (with_nodes, plain)]
    _known[data.session_uid] = np.where(flux[1] > 0, flux[0] / np.where(flux[1] > 0, flux[1], 1), 1.0)
    return _known[data.session_uid]


def known_tint(data: bpy.types.Light) -> np.ndarray | None:
    """What ``measured_tint`` found when it was last asked."""
    return _known.get(data.session_uid)


def _received(light: bpy.types.Light) -> np.ndarray:
    """(3,) proportional to the light that reaches a sphere around ``light``."""
    size = max(getattr(light, name, 0.0) for name in ("shadow_soft_size", "size", "size_y"))
    scene = bpy.data.scenes.new("Gridlight Light")
    lamp = bpy.data.objects.new("Gridlight Light", light)
    lamp.visible_camera = False
    scene.collection.objects.link(lamp)
    scene.collection.objects.link(bpy.data.objects.new("Gridlight Shell", _shell(max(_RADIUS_M, _SIZES * size))))
    scene.camera = new_camera(scene)
    panoramic_camera(scene.camera)
    plain_render_settings(scene)
    unbiased_settings(scene, _SAMPLES, bounces=0)
    scene.render.use_persistent_data = False  # Cycles would look for this scene when it is gone
    scene.render.resolution_x, scene.render.resolution_y = _WIDTH, _WIDTH // 2
    return project_panorama(render_pixels(scene, scene.view_layers[0].name), 1)[0]


def _shell(radius: float) -> bpy.types.Mesh:
    """A sphere of quads with the default material."""
    columns, rows = 64, 32
    v, u = np.mgrid[: rows + 1, :columns]
    polar, angle = np.pi * v / rows, 2 * np.pi * u / columns
    places = radius * np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=-1)
    start = np.arange(rows)[:, None] * columns + np.arange(columns)
    after = np.arange(rows)[:, None] * columns + (np.arange(columns) + 1) % columns
    faces = np.stack([start, start + columns, after + columns, after], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Gridlight Shell")
    mesh.from_pydata(places.reshape(-1, 3).tolist(), [], faces.tolist())
    return mesh
