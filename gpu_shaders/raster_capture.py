# SPDX-License-Identifier: GPL-3.0-or-later
"""Capture by the layered pass: which clusters of triangles are drawn into which faces, and the draw."""

from __future__ import annotations

import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ..core.conventions import FACE_FORWARD, FACE_RIGHT, FACE_UP
from .programs import program
from .scene_textures import SceneTextures
from .textures import layers, upload

CLUSTER_SIZE = 64  # triangles drawn together, neighbours in leaf order
_PAIRS_AT_ONCE = 1 << 22
# Inner normals of the four planes of each face's pyramid.
_PLANES = np.stack(
    [FACE_FORWARD + FACE_RIGHT, FACE_FORWARD - FACE_RIGHT, FACE_FORWARD + FACE_UP, FACE_FORWARD - FACE_UP], axis=1
)  # (6, 4, 3)


def visible_pairs(low: np.ndarray, high: np.ndarray, probes: np.ndarray) -> np.ndarray:
    """(N, 2) int (cluster, layer) for every cluster box that may be seen in a face; layer = probe·6 + face.

    ``low``, ``high`` (C, 3) boxes, ``probes`` (P, 3) positions in the same frame. Conservative: a box is left out only
    when it lies wholly outside one plane of the face's pyramid. Sorted by layer.
    """
    centre, half = (low + high) / 2, (high - low) / 2
    offset = centre[None] - probes[:, None]  # (P, C, 3)
    found = []
    for face in range(6):
        seen = np.ones(offset.shape[:2], bool)
        for plane in _PLANES[face]:
            seen &= offset @ plane + half @ np.abs(plane) >= 0
        probe, cluster = np.nonzero(seen)
        found.append(np.stack([cluster, probe * 6 + face], axis=1))
    pairs = np.concatenate(found)
    return pairs[np.argsort(pairs[:, 1], kind="stable")]


class RasterCapture:
    """Draws hits of batches of probes; one instanced draw covers all faces of a batch."""

    def __init__(self, scene: SceneTextures, face: int, most_probes: int):
        self._scene = scene
        self._face = face
        starts = np.arange(0, scene.triangle_count, CLUSTER_SIZE)
        self._low = np.minimum.reduceat(scene.corners.min(axis=1), starts).astype(float)
        self._high = np.maximum.reduceat(scene.corners.max(axis=1), starts).astype(float)
        self._shader = program("capture_raster", FACE=face, CLUSTER_SIZE=CLUSTER_SIZE, **scene.ray_defines)
        vertices = np.arange(3 * CLUSTER_SIZE, dtype=np.float32)
        self._batch = batch_for_shader(self._shader, "TRIS", {"vertex_number": vertices})
        self._depth = layers(face, face, most_probes * 6, "DEPTH_COMPONENT32F")
        low, high = self._low.min(axis=0), self._high.max(axis=0)
        self._extent = float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high))))

    def __call__(self, probes: np.ndarray, first_slot: int, probe_slots, hits) -> None:
        """Fills ``hits`` for ``probes`` (P, 3), which are the slots from ``first_slot`` on."""
        hits.clear(format="FLOAT", value=(-1.0, 0.0, 0.0, 0.0))
        self._depth.clear(format="FLOAT", value=(1.0,))
        reach = self._extent + float(np.linalg.norm(probes, axis=1).max())
        framebuffer = gpu.types.GPUFrameBuffer(color_slots=(hits,), depth_slot=self._depth)
        probes_at_once = max(1, _PAIRS_AT_ONCE // (6 * len(self._low)))
        with framebuffer.bind():
            gpu.state.viewport_set(0, 0, self._face, self._face)
            gpu.state.depth_test_set("LESS_EQUAL")
            gpu.state.depth_mask_set(True)
            gpu.state.face_culling_set("NONE")
            gpu.state.blend_set("NONE")
            shader = self._shader
            shader.bind()
            for start in range(0, len(probes), probes_at_once):
                pairs = visible_pairs(self._low, self._high, probes[start : start + probes_at_once])
                if not len(pairs):
                    continue
                pairs[:, 1] += start * 6
                instances = np.zeros((len(pairs), 4), np.float32)
                instances[:, :2] = pairs
                instance_texture = upload(instances, "visible cluster pairs")
                self._scene.bind_rays(shader)
                shader.uniform_sampler("probe_slots", probe_slots)
                shader.uniform_sampler("instances", instance_texture)
                shader.uniform_int("first_slot", (first_slot,))
                shader.uniform_int("triangle_count", (self._scene.triangle_count,))
                shader.uniform_float("near_distance", reach * 1e-12)
                shader.uniform_float("far_distance", reach)
                self._batch.draw_instanced(shader, instance_count=len(pairs))
            gpu.state.depth_mask_set(False)
            gpu.state.depth_test_set("NONE")
