# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes of a light that have no counterpart here (IES profiles, textures, falloffs) make of its light: Cycles
lights a white shell around it, with the nodes and without."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.light_profiles import DISTANCES_M, HEIGHT, WIDTH, LightProfile
from ..core.panorama import panorama_solid_angles
from .cycles_reference import panoramic_camera, unbiased_settings
from .temporary import leave_nothing_behind, new_camera, plain_render_settings, render_pixels

_SAMPLES = 32
_RADIUS_M = 1.0  # of the shell, for lamps smaller than a tenth of it
_SIZES = 10.0  # of larger lamps, in its radius
_SMALL_M = 1e-3  # of a lamp whose falloff is asked for

_known: dict[int, LightProfile] = {}  # by the light's session_uid, for those who must not render


def measured_profile(data: bpy.types.Light) -> LightProfile:
    """Factors of the light's nodes by direction, at a metre or farther where it is large, and by distance; not for
    suns."""
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
        size = max(getattr(data, name, 0.0) for name in ("shadow_soft_size", "size", "size_y"))
        radius = max(_RADIUS_M, _SIZES * size)
        received, expected = (_received(light, radius) for light in (with_nodes, plain))
        by_direction = np.where(expected > 0, received / np.where(expected > 0, expected, 1), 1.0)
        by_distance = np.ones(len(DISTANCES_M))
        if _asks_for_distance(data.node_tree, set()):
            by_distance = _falloff(with_nodes, plain, radius)
    _known[data.session_uid] = LightProfile(by_direction.astype(np.float32), by_distance)
    return _known[data.session_uid]


def known_profile(data: bpy.types.Light) -> LightProfile | None:
    """What ``measured_profile`` found when it was last asked."""
    return _known.get(data.session_uid)


def _asks_for_distance(tree: bpy.types.NodeTree, seen: set) -> bool:
    """Whether nodes of ``tree`` know how far light has come."""
    if tree in seen:
        return False
    seen.add(tree)
    return any(
        node.bl_idname in ("ShaderNodeLightFalloff", "ShaderNodeLightPath", "ShaderNodeCameraData")
        or (node.type == "GROUP" and node.node_tree is not None and _asks_for_distance(node.node_tree, seen))
        for node in tree.nodes
    )


def _falloff(with_nodes: bpy.types.Light, plain: bpy.types.Light, radius: float) -> np.ndarray:
    """(len(DISTANCES_M),) factor of the nodes at each distance over that at ``radius``, mean of directions."""
    for light in (with_nodes, plain):
        for name in ("shadow_soft_size", "size", "size_y"):
            if hasattr(light, name):
                setattr(light, name, _SMALL_M)
    weights = panorama_solid_angles(WIDTH, HEIGHT)[..., None]
    factors = []
    for distance in (*DISTANCES_M, radius):
        flux = [float((_received(light, distance) * weights).sum()) for light in (with_nodes, plain)]
        factors.append(flux[0] / flux[1] if flux[1] > 0 else 0.0)
    return np.array(factors[:-1]) / factors[-1] if factors[-1] > 0 else np.ones(len(DISTANCES_M))


def _received(light: bpy.types.Light, radius: float) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) proportional to the light that each part of a sphere around ``light`` gets."""
    scene = bpy.data.scenes.new("Gridlight Light")
    lamp = bpy.data.objects.new("Gridlight Light", light)
    lamp.visible_camera = False
    scene.collection.objects.link(lamp)
    scene.collection.objects.link(bpy.data.objects.new("Gridlight Shell", _shell(radius)))
    scene.camera = new_camera(scene)
    panoramic_camera(scene.camera)
    plain_render_settings(scene)
    unbiased_settings(scene, _SAMPLES, bounces=0)
    scene.render.use_persistent_data = False  # Cycles would look for this scene when it is gone
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    return render_pixels(scene, scene.view_layers[0].name)


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
