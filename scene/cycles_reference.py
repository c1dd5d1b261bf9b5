# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced panoramas of a scene by Cycles: the reference that bakes are measured against.

The settings remove everything by which Cycles trades truth for speed: clamping, light thresholds, filters wider than a
pixel, adaptive sampling, denoising, switched-off caustics. Light objects are hidden from the camera because probes hold
the light of surfaces and of the world only.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Euler

from .evaluation import rendered_objects
from .temporary import render_pixels, scene_copy

# Turns a panoramic camera so that its picture is laid out as core.panorama says: middle +X, top +Z.
PANORAMA_ROTATION = (np.pi / 2, 0.0, -np.pi / 2)

# Panoramic cameras clip too; a probe may stand closer to a wall than the default 0.1 m.
_CLIP_NEAR_M, _CLIP_FAR_M = 1e-6, 1e7

_FAR_M = 1000.0  # from the origin: single precision has 0.06 mm there


def render_panoramas(
    scene: bpy.types.Scene,
    positions: np.ndarray,
    width: int,
    height: int,
    samples: int,
    seed: int = 0,
    bounces: int = 32,
    *,
    frame: int | None = None,
    progress=None,
) -> np.ndarray:
    """Radiance seen from ``positions`` (N, 3), world space, metres.

    A rigid body simulation is not part of the copy that is rendered: apply or bake it to keyframes first. Panorama
    ``n`` is rendered with seed ``seed + n``, so the noise of different positions is independent.

    Args:
        bounces: the path length limit for every kind of ray; paths end earlier only by Russian roulette.
        progress: called as ``progress(done, N)`` after each panorama.

    Returns:
        (N, height, width, 3) float32 linear radiance, laid out as in ``core.panorama``.
    """
    positions = np.asarray(positions, float).reshape(-1, 3)
    panoramas = np.empty((len(positions), height, width, 3), np.float32)
    with scene_copy(scene, frame) as copy, _lights_hidden_from_camera(copy):
        positions = positions - _brought_near(copy, positions)
        unbiased_settings(copy, samples, bounces)
        copy.render.resolution_x, copy.render.resolution_y = width, height
        panoramic_camera(copy.camera)
        layer = copy.view_layers[0].name
        for index, position in enumerate(positions):
            copy.camera.location = position
            copy.cycles.seed = (seed + index) % (2**31 - 1)
            panoramas[index] = render_pixels(copy, layer)
            if progress is not None:
                progress(index + 1, len(positions))
    return panoramas


def _brought_near(copy: bpy.types.Scene, positions: np.ndarray) -> np.ndarray:
    """(3,) metres by which ``copy`` was moved towards the origin, where ``positions`` (N, 3) are far from it.

    Cycles works in single precision: at 100 km its light is off by percents, at 1000 km it is wrong. The scene's
    objects stay where they are, since they are the user's own; they are replaced by one instance of all of them.
    """
    centre = np.rint(positions.mean(axis=0))
    if not len(positions) or np.abs(centre).max() < _FAR_M:
        return np.zeros(3)
    everything = bpy.data.collections.new("Gridlight Everything")
    rendered = rendered_objects(copy.view_layers[0])
    for item in copy.objects:
        if item.session_uid in rendered and item != copy.camera:
            everything.objects.link(item)
    instance = bpy.data.objects.new("Gridlight Everything", None)
    instance.instance_type = "COLLECTION"
    instance.instance_collection = everything
    everything.instance_offset = centre
    for collection in list(copy.collection.children):
        copy.collection.children.unlink(collection)
    for item in list(copy.collection.objects):
        if item != copy.camera:
            copy.collection.objects.unlink(item)
    copy.collection.objects.link(instance)
    return centre


def panoramic_camera(camera: bpy.types.Object) -> None:
    """Make ``camera`` see the whole sphere in the layout of ``core.panorama``."""
    camera.data.type = "PANO"
    camera.data.panorama_type = "EQUIRECTANGULAR"
    camera.data.clip_start, camera.data.clip_end = _CLIP_NEAR_M, _CLIP_FAR_M
    camera.rotation_euler = Euler(PANORAMA_ROTATION)


def unbiased_settings(scene: bpy.types.Scene, samples: int, bounces: int) -> None:
    """Make ``scene`` render with Cycles, ``samples`` per pixel, without any shortcut that changes the expected
    value."""
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = True
    cycles = scene.cycles
    cycles.samples = samples
    cycles.use_adaptive_sampling = False
    cycles.time_limit = 0.0
    cycles.sample_offset = 0
    cycles.use_animated_seed = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"  # one pixel wide: pixels do not bleed into each other
    cycles.film_exposure = 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.use_fast_gi = False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = max(bounces, 32)
    cycles.use_auto_tile = False


@contextmanager
def _lights_hidden_from_camera(scene: bpy.types.Scene) -> Iterator[None]:
    """Hide every light object from camera rays; instanced lights follow the object they are instances of."""
    lights = [item for item in bpy.data.objects if item.type == "LIGHT" and item.visible_camera]
    try:
        for light in lights:
            light.visible_camera = False
        yield
    finally:
        for light in lights:
            light.visible_camera = True
