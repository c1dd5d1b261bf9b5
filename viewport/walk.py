# SPDX-License-Identifier: GPL-3.0-or-later
"""Walking and looking in a 3D view."""

from __future__ import annotations

import math

import bpy
from mathutils import Matrix, Vector

_STEEPEST = math.radians(89.0)
_LONGEST_STEP_SECONDS = 0.25  # a slow machine must not throw the walker through walls
VIEW_SENSOR_MM = 72.0  # what a 3D view's lens is measured against


class Walker:
    """An eye with a heading that moves a view along. Angles in radians, speed in metres a second."""

    def __init__(self, space: bpy.types.SpaceView3D, region_3d: bpy.types.RegionView3D, speed: float):
        self._space = space
        self._view = region_3d
        self._lens = space.lens
        self._was_camera = region_3d.view_perspective == "CAMERA"
        self.speed = speed
        camera = space.camera if self._was_camera else None
        if camera is not None:
            to_world = camera.matrix_world.normalized()
            forward = -to_world.col[2].xyz  # type: ignore[index]
            self.eye = to_world.translation.copy()
            if camera.type == "CAMERA":
                space.lens = camera.data.lens * VIEW_SENSOR_MM / camera.data.sensor_width
        else:  # not from the view's matrix, which is as old as the last redraw
            forward = region_3d.view_rotation @ Vector((0.0, 0.0, -1.0))
            self.eye = region_3d.view_location - forward * region_3d.view_distance
        self.heading = math.atan2(-forward.x, forward.y)
        self.pitch = math.asin(max(-1.0, min(1.0, forward.z)))
        region_3d.view_perspective = "PERSP"
        self._place()

    def look(self, right: float, up: float) -> None:
        """Turns by angles."""
        self.heading -= right
        self.pitch = max(-_STEEPEST, min(_STEEPEST, self.pitch + up))
        self._place()

    def move(self, ahead: float, right: float, up: float, seconds: float) -> None:
        """Walks for ``seconds``; directions are −1..1, ``ahead`` and ``right`` along the floor."""
        forward = Vector((-math.sin(self.heading), math.cos(self.heading), 0.0))
        side = Vector((forward.y, -forward.x, 0.0))
        way = ahead * forward + right * side + Vector((0.0, 0.0, up))
        if way.length > 1.0:
            way.normalize()
        self.eye += way * self.speed * min(seconds, _LONGEST_STEP_SECONDS)
        self._place()

    def leave(self) -> None:
        """Gives the view its lens back, and the camera where it looked through one."""
        self._space.lens = self._lens
        if self._was_camera:
            self._view.view_perspective = "CAMERA"

    def _place(self) -> None:
        turn = Matrix.Rotation(self.heading, 3, "Z") @ Matrix.Rotation(self.pitch + math.pi / 2, 3, "X")
        self._view.view_rotation = turn.to_quaternion()
        self._view.view_location = self.eye - turn @ Vector((0.0, 0.0, self._view.view_distance))
