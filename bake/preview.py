# SPDX-License-Identifier: GPL-3.0-or-later
"""``preview.png`` and ``preview_probes.png``: what a bake looks like."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np

from ..core import camera as cameras
from ..core.display import standard_view
from ..core.errors import Cancelled
from ..core.field import Field
from ..core.snapshot import SceneSnapshot
from ..gpu_shaders.dispatch import is_software
from ..gpu_shaders.preview_pass import PreviewPass
from ..gpu_shaders.scene_textures import SceneTextures

WIDTH, HEIGHT = 960, 540
_SAMPLES, _SOFTWARE_SAMPLES = 6, 3  # per pixel where one shows; in software two take as long as a bake
_SHADOW_RAYS = 32  # per pixel: scenes with many lamps get fewer samples


def write_previews(
    snapshot: SceneSnapshot,
    scene: SceneTextures,
    field: Field,
    picture: Path,
    probes: Path,
    should_stop: Callable[[], bool],
) -> None:
    """Renders the scene with ``field``, once plain and once with its probes as spheres, into two PNG files.

    ``scene`` holds ``snapshot`` with the field's grid centre as origin. The view is the scene's camera, or one inside
    the volume. Colours go through the Standard view transform with the scene's exposure.

    Raises:
        Cancelled: ``should_stop`` returned true.
    """
    camera = snapshot.camera or cameras.suggest(field, WIDTH / HEIGHT)
    renderer = PreviewPass(snapshot, scene, field, field.grid.center)
    most = _SOFTWARE_SAMPLES if is_software() else _SAMPLES
    samples = int(np.clip(_SHADOW_RAYS // max(len(snapshot.lights), 1), 2, most))
    pictures = renderer.render(camera, WIDTH, HEIGHT, samples, exposure=snapshot.exposure, should_stop=should_stop)
    if pictures is None:
        raise Cancelled("cancelled; nothing was written")
    for path, radiance in zip((picture, probes), pictures):
        save_png(path, standard_view(radiance[..., :3], snapshot.exposure))


def save_png(path: Path, values: np.ndarray) -> None:
    """Writes display ``values`` (height, width, 3), row 0 at the bottom, as an 8-bit PNG."""
    height, width = values.shape[:2]
    image = bpy.data.images.new("Gridlight preview", width, height)
    try:
        pixels = np.ones((height, width, 4), np.float32)
        pixels[..., :3] = values
        image.pixels.foreach_set(pixels.reshape(-1))  # type: ignore[arg-type]
        image.filepath_raw = str(path)
        image.file_format = "PNG"
        image.save()
    finally:
        bpy.data.images.remove(image)
