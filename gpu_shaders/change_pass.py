# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks captured probes on the GPU whether they can see a change of shape; the twin is core/change_reach.py."""

from __future__ import annotations

import gpu
import numpy as np

from .programs import program
from .textures import allocate, read, upload

_GROUP = 64


def probes_reached(
    geometry: gpu.types.GPUTexture,
    probe_slots: gpu.types.GPUTexture,
    first: int,
    count: int,
    face: int,
    old_boxes: np.ndarray,
    new_boxes: np.ndarray,
) -> np.ndarray:
    """(count,) bool of the probes in slots from ``first`` on whose texel surfaces are the layers of ``geometry``.

    ``old_boxes`` and ``new_boxes`` (K, 2, 3): around what is gone and what is new, relative to the volume's centre and
    already grown.
    """
    boxes = np.zeros((len(old_boxes) + len(new_boxes), 2, 4), np.float32)
    boxes[:, :, :3] = np.concatenate([old_boxes, new_boxes])
    shader = program("probe_reach_comp", FACE=face, GROUP=_GROUP)
    box_texture, reached = upload(boxes, "boxes"), allocate(count, "probes", "R32F")
    shader.uniform_sampler("probe_slots", probe_slots)
    shader.uniform_sampler("change_boxes", box_texture)
    shader.uniform_sampler("geometry", geometry)
    shader.image("reached", reached)
    for name, value in (("first_slot", first), ("box_count", len(boxes)), ("old_count", len(old_boxes))):
        shader.uniform_int(name, (value,))
    gpu.compute.dispatch(shader, count, 1, 1)
    return read(reached, count, channels=1)[:, 0] > 0
