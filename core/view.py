# SPDX-License-Identifier: GPL-3.0-or-later
"""A view for rasterising: a camera's rays together with the matrix that projects points the same way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .camera import Camera


@dataclass(frozen=True)
class View:
    """``camera`` gives the rays through the image (``right`` and ``up`` reach to its edges, ``forward`` need not be a
    unit vector where the image is shifted); ``to_clip`` (4, 4) float64 maps world points to clip space, −w..w in depth.
    """

    camera: Camera
    to_clip: np.ndarray

    @classmethod
    def from_matrices(cls, view: np.ndarray, window: np.ndarray) -> View:
        """From Blender's ``view_matrix`` and ``window_matrix``, (4, 4) each.

        Holds for any pinhole or parallel projection: shifted lenses, camera views that are panned and zoomed.
        """
        view, window = np.asarray(view, float), np.asarray(window, float)
        to_world = np.linalg.inv(view)
        right, up, back = to_world[:3, 0], to_world[:3, 1], to_world[:3, 2]
        half = 1.0 / window[0, 0], 1.0 / window[1, 1]
        orthographic = abs(window[3, 2]) < 1e-12
        position, forward = to_world[:3, 3], -back
        if orthographic:
            position = position - right * window[0, 3] * half[0] - up * window[1, 3] * half[1]
        else:
            forward = forward + right * window[0, 2] * half[0] + up * window[1, 2] * half[1]
        camera = Camera(position, right * half[0], up * half[1], forward, orthographic)
        return cls(camera, window @ view)

    @classmethod
    def from_camera(cls, camera: Camera, near: float, far: float) -> View:
        """``near`` and ``far``: distances along ``forward`` in metres where the view begins and ends."""
        axes = np.linalg.inv(np.stack([camera.right, camera.up, camera.forward], axis=1))
        place = np.zeros((4, 4))
        place[:3, :3] = axes
        place[:3, 3] = -axes @ camera.position
        place[3, 3] = 1.0
        window = np.eye(4)
        if camera.orthographic:
            window[2, 2:] = 2 / (far - near), -(far + near) / (far - near)
        else:
            window[2, 2:] = (far + near) / (far - near), -2 * far * near / (far - near)
            window[3] = 0, 0, 1, 0
        return cls(camera, window @ place)

    def relative_to(self, origin: np.ndarray) -> View:
        """The same view of a world whose origin is ``origin`` (3,)."""
        move = np.eye(4)
        move[:3, 3] = origin
        return View(replace(self.camera, position=self.camera.position - origin), self.to_clip @ move)

    def angular_width(self, height: int) -> float:
        """Radians that a pixel of an image ``height`` pixels high spans in its middle; metres where orthographic."""
        span = 2.0 * float(np.linalg.norm(self.camera.up)) / height
        return span if self.camera.orthographic else span / float(np.linalg.norm(self.camera.forward))
