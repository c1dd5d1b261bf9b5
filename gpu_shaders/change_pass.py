# SPDX-License-Identifier: GPL-3.0-or-later
"""What a relight does with texel surfaces instead of capturing again: asks which can see a change, looks up their
materials anew, takes them over into other layers."""

from __future__ import annotations

import gpu
import numpy as np

from ..core.scene_changes import ShapeChange
from .backend import GpuBackend, Surfaces
from .programs import program
from .textures import allocate, read, upload

_GROUP = 64
_IMAGES = ("geometry", "albedo", "emission")


def probes_reached(backend: GpuBackend, surfaces: Surfaces, old_boxes: np.ndarray, new_boxes: np.ndarray) -> np.ndarray:
    """(count,) bool of the probes of ``surfaces`` that a change of shape can reach; the twin is core/change_reach.py.

    ``old_boxes`` and ``new_boxes`` (K, 2, 3): around what is gone and what is new, relative to the volume's centre and
    already grown.
    """
    boxes = np.zeros((len(old_boxes) + len(new_boxes), 2, 4), np.float32)
    boxes[:, :, :3] = np.concatenate([old_boxes, new_boxes])
    box_texture, reached = upload(boxes, "boxes"), allocate(surfaces.count, "probes", "R32F")
    shader = program("probe_reach_comp", FACE=backend.face, GROUP=_GROUP)
    shader.uniform_sampler("probe_slots", backend.probe_slots)
    shader.uniform_sampler("change_boxes", box_texture)
    shader.uniform_sampler("geometry", surfaces.textures["geometry"])
    shader.image("reached", reached)
    for name, value in (("first_slot", surfaces.first), ("box_count", len(boxes)), ("old_count", len(old_boxes))):
        shader.uniform_int(name, (value,))
    gpu.compute.dispatch(shader, surfaces.count, 1, 1)
    return read(reached, surfaces.count, channels=1)[:, 0] > 0


def resolve_again(backend: GpuBackend, surfaces: Surfaces, new_numbers: np.ndarray | None = None) -> bool:
    """Albedo and emission of ``surfaces`` for the scene as it is now, where what they hit is still where it was.

    ``new_numbers`` (T,): new number of each old triangle in leaf order, −1 for none; None where numbers stayed. Returns
    whether a texel that reflected nothing now does, or the other way round.
    """
    rebind = allocate(1, "flags", "R32F")
    defines = backend.scene.surface_defines | backend.scene.gloss_defines | {"RENUMBER": new_numbers is not None}
    shader = program("surface_again_comp", FACE=backend.face, **defines)
    backend.scene.bind_surfaces(shader)
    backend.scene.bind_gloss(shader)
    shader.uniform_sampler("probe_slots", backend.probe_slots)
    shader.uniform_sampler("world_texels", backend.world_texels)
    if new_numbers is not None:
        rows = np.zeros((len(new_numbers), 4), np.float32)
        rows[:, 0] = new_numbers
        numbers = upload(rows, "triangles")
        shader.uniform_sampler("new_numbers", numbers)
    for name in _IMAGES:
        shader.image(name, surfaces.textures[name])
    shader.image("rebind", rebind)
    if backend.scene.has_images:  # only they depend on where a texel is seen from; compilers drop the rest
        shader.uniform_int("first_slot", (surfaces.first,))
    _dispatch_layers(shader, backend.face, surfaces.count)
    return bool(read(rebind, 1, channels=1)[0, 0])


def new_numbers(shape: ShapeChange, old_order: np.ndarray, new_order: np.ndarray) -> np.ndarray:
    """(T,) number in the new leaf order of each triangle of the old one, −1 for those that are gone."""
    before = np.arange(len(new_order)) if shape.triangle_map is None else shape.triangle_map
    now = np.full(len(old_order), -1)
    now[before[before >= 0]] = np.flatnonzero(before >= 0)
    place = np.empty(len(new_order), int)
    place[new_order] = np.arange(len(new_order))
    return np.where(now[old_order] >= 0, place[now[old_order]], -1)


def move_layers(backend: GpuBackend, old: Surfaces, new: Surfaces, from_layer: np.ndarray) -> None:
    """Takes layers of ``old`` over into ``new``: ``from_layer`` (new.count,) int, −1 where nothing is taken over."""
    rows = np.zeros((len(from_layer), 4), np.float32)
    rows[:, 0] = from_layer
    shader = program("layers_move_comp", FACE=backend.face)
    source = upload(rows, "layers")
    shader.uniform_sampler("from_layer", source)
    for name in _IMAGES:
        shader.uniform_sampler(f"old_{name}", old.textures[name])
        shader.image(name, new.textures[name])
    _dispatch_layers(shader, backend.face, new.count)


def _dispatch_layers(shader, face: int, count: int) -> None:
    gpu.compute.dispatch(shader, -(-face // 8), -(-6 * face // 8), count)
