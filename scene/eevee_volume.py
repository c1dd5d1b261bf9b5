# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's light probe volumes as a peer of ours: one with the same probes, and what light it holds.

What EEVEE bakes cannot be read from Python. Its light is measured as it is used: white cards at nodes, rendered by
EEVEE after the bake with nothing else in the scene and no lamps.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.grid import Grid
from .bench_rooms import diffuse_material
from .temporary import new_camera, plain_render_settings, render_pixels

_PICTURE, _CARD_PIXELS, _CARD_SAMPLES = 640, 7, 4  # cards are so small that they do not cover each other


def add_volume(scene: bpy.types.Scene, grid: Grid, samples: int) -> bpy.types.Object:
    """A light probe volume whose probes stand at the nodes of ``grid``; ``scene`` renders with EEVEE from now on."""
    scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"
    data = bpy.data.lightprobes.new("EEVEE volume", "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = grid.resolution
    data.bake_samples = samples
    # EEVEE's probes sit in the middle of cells, ours at their corners: its box is larger by half a cell on every side.
    counts = np.array(grid.resolution)
    matrix = grid.matrix.copy()
    matrix[:3, :3] *= np.where(counts > 1, counts / np.maximum(counts - 1, 1), 1.0)
    item = bpy.data.objects.new("EEVEE volume", data)
    item.matrix_world = Matrix(matrix.tolist())
    scene.collection.objects.link(item)
    scene.view_layers[0].update()
    return item


def irradiance_on_cards(
    scene: bpy.types.Scene, item: bpy.types.Object, nodes: np.ndarray, normals: np.ndarray, progress: Callable[[], None]
) -> np.ndarray:
    """(N, S, 3) irradiance at ``nodes`` (N, 3) for ``normals`` (S, 3): white cards there, lit by the volume ``item``
    alone, as EEVEE renders them. One picture shows all cards with one normal; ``progress`` is called after each.

    ``scene`` is of no other use afterwards.
    """
    for thing in scene.objects:
        thing.hide_render = thing != item
    scene.world = None
    # Where and from where to look the light up: at the card itself.
    item.data.normal_bias = item.data.view_bias = item.data.facing_bias = 0.0
    plain_render_settings(scene)
    camera = scene.camera = new_camera(scene)
    camera.data.type = "ORTHO"
    scene.render.resolution_x = scene.render.resolution_y = _PICTURE
    scene.eevee.taa_render_samples = _CARD_SAMPLES
    scene.eevee.use_raytracing = False
    middle = (nodes.min(axis=0) + nodes.max(axis=0)) / 2
    reach = float(np.linalg.norm(nodes - middle, axis=1).max()) + 1.0
    pixel = 2.2 * reach / _PICTURE
    cards = _cards(scene, nodes, _CARD_PIXELS * pixel)
    camera.data.ortho_scale = _PICTURE * pixel
    camera.data.clip_start, camera.data.clip_end = 0.01 * reach, 4 * reach
    found = np.empty((len(nodes), len(normals), 3))
    for side, normal in enumerate(normals):
        turn = Vector(normal).to_track_quat("Z", "Y")  # cards face +Z, cameras look along −Z
        for card in cards:
            card.rotation_euler = turn.to_euler()
        view, places = _view(nodes - middle, np.array(turn.to_matrix()))
        camera.matrix_world = Matrix.Translation(Vector(middle + 2 * reach * view[:, 2])) @ Matrix(view).to_4x4()
        column, row = np.floor(places / pixel + _PICTURE / 2).astype(int).T
        pixels = render_pixels(scene, scene.view_layers[0].name)
        found[:, side] = np.pi * pixels[row, column]
        progress()
    return found


def _cards(scene: bpy.types.Scene, nodes: np.ndarray, edge_m: float) -> list[bpy.types.Object]:
    """A white square at each of ``nodes`` (N, 3), as wide as ``edge_m``."""
    mesh = bpy.data.meshes.new("Card")
    half = edge_m / 2
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(diffuse_material("Card", (1.0, 1.0, 1.0)))
    cards = []
    for node in nodes:
        card = bpy.data.objects.new("Card", mesh)
        card.location = node
        scene.collection.objects.link(card)
        cards.append(card)
    return cards


def _view(offsets: np.ndarray, card: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (3, 3) of a camera that sees the front of cards with axes ``card`` (3, 3), columns right, up, back, and
    where it sees ``offsets`` (N, 3) in its picture, (N, 2). Of some slanted views the one that keeps cards apart most.
    """
    best = None
    for u, v in np.random.default_rng(0).uniform(-0.4, 0.4, (50, 2)):
        back = card @ np.array([u, v, 1.0])
        axes = np.array(Vector(back).to_track_quat("Z", "Y").to_matrix())
        places = offsets @ axes[:, :2]
        apart = np.linalg.norm(places[:, None] - places, axis=2) + np.diag(np.full(len(places), np.inf))
        if best is None or apart.min() > best[0]:
            best = (apart.min(), axes, places)
    return best[1:]


def stored_bytes(item: bpy.types.Object) -> int:
    """Size of ``item`` in a file, the only sign of a baked volume that Python can see."""
    with tempfile.TemporaryDirectory(prefix="gridlight-") as folder:
        path = os.path.join(folder, "item.blend")
        bpy.data.libraries.write(path, {item})
        return os.path.getsize(path)
