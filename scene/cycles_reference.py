# SPDX-License-Identifier: GPL-3.0-or-later
"""Path-traced panoramas of a scene by Cycles: the reference that bakes are measured against.

The settings remove everything by which Cycles trades truth for speed: clamping, light thresholds, filters wider than a
pixel, adaptive sampling, denoising, switched-off caustics. Light objects are hidden from the camera because probes hold
the light of surfaces and of the world only; of other objects it sees those that diffuse rays see, and what materials
show those rays, because what probes light is diffuse.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import bpy
import numpy as np
from mathutils import Euler

from ..core.panorama import panorama_coordinates, panorama_directions, panorama_solid_angles
from ..core.snapshot import Light
from .camera_answers import as_to_diffuse_rays
from .evaluation import rendered_objects
from .temporary import render_pixels, scene_copy

# Turns a panoramic camera so that its picture is laid out as core.panorama says: middle +X, top +Z.
PANORAMA_ROTATION = (np.pi / 2, 0.0, -np.pi / 2)

# Panoramic cameras clip too; a probe may stand closer to a wall than the default 0.1 m.
_CLIP_NEAR_M, _CLIP_FAR_M = 1e-6, 1e7

# How finely suns of the world are rendered: pixels across one, and samples of each. A pixel of a few degrees, with
# samples all over it, hardly meets a disc.
_ACROSS_SUN, _SUN_SAMPLES, _MOST_WIDTH = 6, 256, 32768
_INSIDE = 0.01  # of a pixel

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
    suns: Sequence[Light] = (),
    frame: int | None = None,
    progress=None,
) -> np.ndarray:
    """Radiance seen from ``positions`` (N, 3), world space, metres.

    A rigid body simulation is not part of the copy that is rendered: apply or bake it to keyframes first. Panorama
    ``n`` is rendered with seed ``seed + n``, so the noise of different positions is independent.

    Args:
        bounces: the path length limit for every kind of ray; paths end earlier only by Russian roulette.
        suns: of the world (``core.world_suns``). What is seen of them is rendered again, so finely that no sample
            misses it, and shared out between the four pixels around its direction: a single one would move it by
            degrees.
        progress: called as ``progress(done, N)`` after each panorama.

    Returns:
        (N, height, width, 3) float32 linear radiance, laid out as in ``core.panorama``.
    """
    positions = np.asarray(positions, float).reshape(-1, 3)
    panoramas = np.empty((len(positions), height, width, 3), np.float32)
    with scene_copy(scene, frame) as copy, _seen_as_by_diffuse_rays(), as_to_diffuse_rays():
        positions = positions - _brought_near(copy, positions)
        unbiased_settings(copy, samples, bounces)
        copy.render.resolution_x, copy.render.resolution_y = width, height
        panoramic_camera(copy.camera)
        layer = copy.view_layers[0].name
        for other in copy.view_layers[1:]:  # Cycles, which keeps its data, shows them from the second picture on
            copy.view_layers.remove(other)
        for index, position in enumerate(positions):
            copy.camera.location = position
            copy.cycles.seed = (seed + index) % (2**31 - 1)
            panoramas[index] = render_pixels(copy, layer)
            for sun in suns:
                if sun.angle < np.pi / height:  # samples do not miss what fills pixels
                    _refine(copy, layer, panoramas[index], sun)
            if progress is not None:
                progress(index + 1, len(positions))
    return panoramas


def _refine(copy: bpy.types.Scene, layer: str, panorama: np.ndarray, sun: Light) -> None:
    """Put what is seen of ``sun`` into ``panorama``, in place of what samples met of it."""
    height, width = panorama.shape[:2]
    rows, columns = _covered(sun, width, height)
    around = panorama[np.clip([rows[0] - 1, rows[-1] + 1], 0, height - 1)][:, columns].reshape(-1, 3)
    level = np.median(around, axis=0)
    panorama[np.ix_(rows, columns)] = level
    finer = int(np.clip(np.ceil(_ACROSS_SUN * np.pi / height / max(sun.angle, 1e-6)), 1, _MOST_WIDTH // width))
    flux, towards = np.zeros(3), np.zeros(3)
    for radiance, solid_angles, directions in _close_up(copy, layer, sun, width * finer, height * finer):
        light = np.maximum(radiance - level, 0.0) * solid_angles[..., None]
        flux += light.sum(axis=(0, 1))
        towards += np.einsum("rc,rci->i", light.sum(axis=-1), directions)
    if not flux.any():
        return
    place = panorama_coordinates(towards) * [width, height] - 0.5
    first = np.floor(place).astype(int)
    for step in np.ndindex(2, 2):
        share = np.where(step, place - first, 1 - (place - first)).prod()
        column, row = (first[0] + step[0]) % width, int(np.clip(first[1] + step[1], 0, height - 1))
        panorama[row, column] += share * flux / panorama_solid_angles(width, height)[row, column]


def _close_up(copy: bpy.types.Scene, layer: str, sun: Light, width: int, height: int):
    """Radiance (R, C, 3), solid angles (R, C) and directions (R, C, 3) of those pixels of a panorama of this size that
    ``sun`` covers, in one part, or in two where it stands on the seam."""
    render, cycles = copy.render, copy.cycles
    plain = render.resolution_x, render.resolution_y, cycles.samples
    render.resolution_x, render.resolution_y, cycles.samples = width, height, _SUN_SAMPLES
    render.use_border = render.use_crop_to_border = True
    rows, columns = _covered(sun, width, height)
    # Blender cuts borders down to whole pixels, after rounding them to single precision.
    render.border_min_y, render.border_max_y = (rows[0] + _INSIDE) / height, (rows[-1] + 1 + _INSIDE) / height
    for part in np.split(columns, np.flatnonzero(np.diff(columns) != 1) + 1):
        render.border_min_x, render.border_max_x = (part[0] + _INSIDE) / width, (part[-1] + 1 + _INSIDE) / width
        radiance = render_pixels(copy, layer)
        yield radiance, panorama_solid_angles(width, height, rows, part), panorama_directions(width, height, rows, part)
    render.use_border = render.use_crop_to_border = False
    render.resolution_x, render.resolution_y, cycles.samples = plain


def _covered(sun: Light, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the pixels that the disc of ``sun`` and half as much around it lie on, each sorted."""
    radius = 0.75 * sun.angle
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)[:, None]
    rim = np.cos(angle) * sun.matrix[:3, 0] + np.sin(angle) * sun.matrix[:3, 1]
    rim = np.cos(radius) * sun.matrix[:3, 2] + np.sin(radius) * rim
    column = np.floor(panorama_coordinates(rim)[:, 0] * width).astype(int) % width
    rows = np.arange(_row(rim[:, 2].min(), height), _row(rim[:, 2].max(), height) + 1)
    if np.ptp(column) > width // 2:  # across the seam, or around a pole
        column = np.where(column < width // 2, column + width, column)
    return rows, np.unique(np.arange(column.min(), column.max() + 1) % width)


def _row(z: float, height: int) -> int:
    """Row of a panorama that directions with this z fall into."""
    return min(int((np.arcsin(np.clip(z, -1, 1)) / np.pi + 0.5) * height), height - 1)


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
def _seen_as_by_diffuse_rays() -> Iterator[None]:
    """Let the camera see what diffuse rays see, and no light object; instanced lights follow the object they are
    instances of."""
    wanted = {item: item.type != "LIGHT" and item.visible_diffuse for item in bpy.data.objects}
    changed = [item for item, seen in wanted.items() if item.visible_camera != seen]
    worlds = [world.cycles_visibility for world in bpy.data.worlds]
    worlds = [rays for rays in worlds if rays.camera != rays.diffuse]
    try:
        for item in changed:
            item.visible_camera = wanted[item]
        for rays in worlds:
            rays.camera = not rays.camera
        yield
    finally:
        for item in changed:
            item.visible_camera = not wanted[item]
        for rays in worlds:
            rays.camera = not rays.camera
