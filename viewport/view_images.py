# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of every view on the screen: refined sample by sample while nothing changes, coarse while one moves.

Kept per region, because quad views and windows see the scene from different places, and framebuffers belong to the
window that they were made in.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy
import gpu
import numpy as np

from ..core.view import View
from ..gpu_shaders.viewport_pass import Picture, Probes
from ..gpu_shaders.viewport_shading import Shading
from .sessions import SceneSession

SAMPLES = 16  # of a picture that stands still
_MOVING_SECONDS = 0.05  # what a picture may take while the view moves; it gets coarser to keep that
_STILL_SECONDS = 0.5  # between changes, from where on they count as single ones
_SAMPLING_SECONDS = 0.01  # of a redraw, where the GPU takes more than one sample in that time
_COARSEST = 8  # pixels along the edge of what is drawn as one


@dataclass
class _RegionImage:
    """What one region shows and what it was made from."""

    picture: Picture | None = None
    shown: tuple = ()
    changed_at: float = 0.0
    coarseness: int = 1
    seconds_per_pixel: float = 0.0
    looked_up: tuple = ()  # when visibility was found out
    visible_flags: np.ndarray | None = None
    visible: gpu.types.GPUTexture | None = None


class ViewImages:
    """All regions' pictures, by region."""

    def __init__(self):
        self._images: dict[tuple[int, int], _RegionImage] = {}
        self.is_rough = False  # one sample does: somebody else needs the time

    @property
    def _wanted_samples(self) -> int:
        return 1 if self.is_rough else SAMPLES

    def clear(self) -> None:
        self._images.clear()

    def keep_only(self, areas: list[bpy.types.Area]) -> None:
        """Forgets regions that are not in ``areas`` any more: left quad views, closed windows."""
        alive = {(area.as_pointer(), region.as_pointer()) for area in areas for region in area.regions}
        for key in self._images.keys() - alive:
            del self._images[key]

    def needs_drawing(self, area: bpy.types.Area) -> bool:
        """Does a picture in ``area`` want more samples?"""
        return any(
            image.picture is not None and (image.picture.samples < self._wanted_samples or image.coarseness > 1)
            for (owner, _), image in self._images.items()
            if owner == area.as_pointer()
        )

    def draw(
        self,
        context: bpy.types.Context,
        session: SceneSession,
        shading: Shading,
        probes: Probes | None,
        backdrop: bool = True,
    ) -> tuple[Picture, View]:
        """The picture of the context's region with one sample more where it is not finished. Without ``backdrop`` the
        world behind the scene is left out."""
        region, region_3d = context.region, context.region_data
        image = self._images.setdefault((context.area.as_pointer(), region.as_pointer()), _RegionImage())
        view = View.from_matrices(np.array(region_3d.view_matrix), np.array(region_3d.window_matrix))
        self._find_visible(image, session, context.space_data)
        wanted = (
            session.version,
            view.to_clip.tobytes(),
            (region.width, region.height),
            shading,
            probes,
            backdrop,
            image.visible_flags.tobytes(),
        )
        if image.shown != wanted:
            view_moves = bool(image.shown) and image.shown[1:3] != wanted[1:3]
            since = time.perf_counter() - image.changed_at
            # Where one picture takes longer than that, pictures in a row are movement all the same.
            moving = view_moves or since < _STILL_SECONDS + 4 * image.seconds_per_pixel * region.width * region.height
            image.shown, image.changed_at = wanted, time.perf_counter()
            self._restart(image, region, self._coarseness(image, region) if moving else 1)
        elif image.coarseness > 1:  # the view has come to rest
            self._restart(image, region, 1)
        for _ in range(self._samples_now(image)):
            started = time.perf_counter()
            session.gpu.drawing.draw(image.picture, view, shading, probes, image.visible, backdrop)
            if image.picture.samples == 1:
                image.picture.wait()
                pixels = image.picture.width * image.picture.height
                image.seconds_per_pixel = (time.perf_counter() - started) / pixels
        return image.picture, view

    def _samples_now(self, image: _RegionImage) -> int:
        """Samples for this redraw: one, or as many as hardly take time; none where the picture has all it wants."""
        picture = image.picture
        expected = image.seconds_per_pixel * picture.width * picture.height
        quick = int(_SAMPLING_SECONDS / expected) if expected > 0 else 1
        return min(max(quick, 1), self._wanted_samples - picture.samples)

    @staticmethod
    def _coarseness(image: _RegionImage, region: bpy.types.Region) -> int:
        expected = image.seconds_per_pixel * region.width * region.height
        return int(np.clip(np.ceil(np.sqrt(expected / _MOVING_SECONDS)), 1, _COARSEST))

    @staticmethod
    def _restart(image: _RegionImage, region: bpy.types.Region, coarseness: int) -> None:
        size = -(-region.width // coarseness), -(-region.height // coarseness)
        image.coarseness = coarseness
        if image.picture is None or (image.picture.width, image.picture.height) != size:
            image.picture = Picture(*size)
        image.picture.samples = 0

    @staticmethod
    def _find_visible(image: _RegionImage, session: SceneSession, space: bpy.types.SpaceView3D) -> None:
        """Which objects this view hides: local view, hidden objects and collections. They still light the others."""
        key = (session.version, session.updates, space.local_view is not None, space.use_local_collections)
        if image.looked_up == key:
            return
        names = session.snapshot.object_names
        objects = session.scene.objects
        owners = [name.partition(" > ")[0] for name in names]
        shown = {
            name: name not in objects or objects[name].visible_in_viewport_get(space) for name in dict.fromkeys(owners)
        }
        flags = np.array([shown[name] for name in owners], bool)
        if not np.array_equal(flags, image.visible_flags) or image.looked_up[:1] != key[:1]:
            image.visible = session.gpu.drawing.visible(flags)
        image.visible_flags = flags
        image.looked_up = key
