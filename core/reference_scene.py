# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays meet, readable and slow: every ray against every triangle, and what the surface there is made of.

Readable twin of surface_lib.glsl, for scenes of some hundred triangles. Images are half floats, as the GPU stores them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import rays
from .dithering import dither_threshold
from .faint_gloss import albedo_towards, couplings, faint_rows
from .images import sample_image
from .light_links import link_roles
from .sheets import sheet_numbers
from .snapshot import DIFFUSE_RAYS, DITHERED, FROM_BEHIND, FROM_FRONT, NO_IMAGE, SHADOW_RAYS, SceneSnapshot

# How far below a point surface is looked for, of the step by which rays leave it.
COUPLING_SEARCH = 32.0


@dataclass
class Surfaces:
    """What rays (…) meet. ``distance`` is infinite where that is background."""

    distance: np.ndarray  # (…) metres
    triangle: np.ndarray  # (…) int, −1 background
    back: np.ndarray  # (…) bool: seen from behind
    normal: np.ndarray  # (…, 3) shading normal on the viewer's side
    albedo: np.ndarray  # (…, 3)
    emission: np.ndarray  # (…, 3) radiance


class ReferenceScene:
    """``snapshot`` with positions relative to ``origin`` (3,), as everything here takes and returns them."""

    def __init__(self, snapshot: SceneSnapshot, origin: np.ndarray):
        self.snapshot = snapshot
        self.origin = np.asarray(origin, float)
        self.triangles = snapshot.triangle_positions - self.origin
        clips = np.array([material.alpha_threshold > 0 for material in snapshot.materials])
        self._clipped = clips[snapshot.material_index]
        self._unseen_by = np.array([material.unseen_by for material in snapshot.materials])[snapshot.material_index]
        self.links = link_roles([material.links for material in snapshot.materials])
        sheet_of_material, sheets = sheet_numbers(snapshot.materials, self.links.of_surface)
        self.sheet_shares, self.sheet_roles = sheets[:, :3], sheets[:, 3].astype(int)
        self.sheet = sheet_of_material[snapshot.material_index]  # (T,) see core/sheets.py
        self.role = self.links.of_surface[snapshot.material_index]  # (T,) see core/light_links.py

    def closest(self, origins: np.ndarray, directions: np.ndarray) -> rays.Hits:
        """Nearest hits of rays ``origins``, ``directions`` (N, 3)."""
        return rays.closest_hit(self.triangles, origins, directions, self._hole_test(DIFFUSE_RAYS))

    def visible(self, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, group: int = 0) -> np.ndarray:
        """(N,) bool: does nothing that blocks light of ``group`` lie on the rays nearer than ``limits`` (N,)?"""
        return ~rays.any_hit(self.triangles, origins, directions, limits, self._hole_test(SHADOW_RAYS, group))

    def falls_on(self, group: int | np.ndarray, role: np.ndarray) -> np.ndarray:
        """(N,) bool: does light of ``group`` fall on surfaces of ``role`` (N,)?"""
        return self.links.lit[role, np.where(np.asarray(group) <= self.links.groups, group, 0)]

    def tint(
        self, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, kind: int = SHADOW_RAYS, group: int = 0
    ) -> np.ndarray:
        """(N, 3) what coloured holes nearer than ``limits`` (N,) leave of light along rays of a ``kind``, which hit
        nothing else before."""
        result = np.ones((len(origins), 3))
        passes = self._passed_by(kind, group)
        tinted = np.array([material.is_tinted for material in self.snapshot.materials])[self.snapshot.material_index]
        for number in np.flatnonzero(tinted):
            corners = np.broadcast_to(self.triangles[number], (len(origins), 3, 3))
            distance, barycentric = rays.intersect(corners, origins, directions)
            met = np.flatnonzero((distance > 0) & (distance < limits))
            triangle = np.full(len(met), number)
            met = met[self.is_hole(triangle, barycentric[met]) & ~passes(triangle, directions[met])]
            material = self.snapshot.materials[self.snapshot.material_index[number]]
            result[met] *= material.tint
            if material.tint_image != NO_IMAGE:
                result[met] *= self._image(material.tint_image, np.full(len(met), number), barycentric[met])[:, :3]
        return result

    def _passed_by(self, kind: int, group: int):
        """Which triangles rays of a kind to emitters of ``group`` do not see along their directions."""
        unseen = (self._unseen_by & kind) > 0
        if 0 < group <= self.links.groups:
            unseen = unseen | ~self.links.blocks[self.role, group]

        def passes(triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
            return unseen[triangle] | self.is_missing_side(triangle, directions)

        return passes

    def is_missing_side(self, triangle: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """(K,) bool: is the side of ``triangle`` (K,) not there that looks against ``directions`` (K, 3)?"""
        edge = self.triangles[triangle, 1:] - self.triangles[triangle, :1]
        along = np.einsum("ki,ki->k", np.cross(edge[:, 0], edge[:, 1]), directions)
        sides = np.where(along > 0, FROM_BEHIND, np.where(along < 0, FROM_FRONT, 0))
        return (self._unseen_by[triangle] & sides) > 0

    def _hole_test(self, kind: int, group: int = 0):
        """What rays of a kind pass through on their way to emitters of ``group``; None for nothing."""
        if not (self._unseen_by.any() or self.links.groups or self._clipped.any()):
            return None
        passes = self._passed_by(kind, group)

        def is_hole(triangle: np.ndarray, barycentric: np.ndarray, directions: np.ndarray) -> np.ndarray:
            return passes(triangle, directions) | self.is_hole(triangle, barycentric)

        return is_hole

    def is_hole(self, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(K,) bool: is the material of ``triangle`` (K,) clipped away at ``barycentric`` (K, 2)? Images at full
        resolution."""
        hole = np.zeros(len(triangle), bool)
        for index, material in enumerate(self.snapshot.materials):
            here = np.flatnonzero((self.snapshot.material_index[triangle] == index) & self._clipped[triangle])
            alpha = np.full(len(here), float(material.alpha))
            if material.alpha_image != NO_IMAGE and len(here):
                texel = self._image(material.alpha_image, triangle[here], barycentric[here])
                alpha *= texel[:, :3].mean(axis=1) if material.alpha_from_color else texel[:, 3]
            dithered = material.alpha_threshold >= DITHERED
            threshold = dither_threshold(triangle[here], barycentric[here]) if dithered else material.alpha_threshold
            hole[here] = alpha < threshold
        return hole

    def emission(self, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(K, 3) radiance that ``triangle`` (K,) sends at ``barycentric`` (K, 2), images at full resolution."""
        radiance = np.zeros((len(triangle), 3))
        for index, material in enumerate(self.snapshot.materials):
            here = np.flatnonzero(self.snapshot.material_index[triangle] == index)
            radiance[here] = material.emission
            if material.emission_image != NO_IMAGE:
                radiance[here] *= self._image(material.emission_image, triangle[here], barycentric[here])[:, :3]
        return radiance

    def _image(self, image: int, triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        uv = interpolate(self.snapshot.corner_uvs[triangle], barycentric)
        return sample_image(self.snapshot.images[image], uv, np.zeros(len(uv)))

    def resolve(self, hits: rays.Hits, directions: np.ndarray, spread: float) -> Surfaces:
        """Surfaces where rays along ``directions`` (N, 3) hit; fields of rays that hit nothing are zero. ``spread`` is
        the angular width of the view in radians, which picks the mip level of images."""
        count = len(directions)
        surfaces = Surfaces(
            hits.distance, hits.triangle, np.zeros(count, bool), *(np.zeros((count, 3)) for _ in range(3))
        )
        hit = np.flatnonzero(hits.triangle >= 0)
        triangle, barycentric, direction = hits.triangle[hit], hits.barycentric[hit], directions[hit]
        edge = self.triangles[triangle, 1:] - self.triangles[triangle, :1]
        geometric = np.cross(edge[:, 0], edge[:, 1])
        facing = np.einsum("ni,ni->n", geometric, direction)
        surfaces.back[hit] = facing > 0
        normal = interpolate(self.snapshot.corner_normals[triangle], barycentric)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        surfaces.normal[hit] = np.where(facing[:, None] > 0, -normal, normal)

        # Width of what the view covers on the surface, in uv: distance × angle, stretched by the slant, × uv units per
        # metre.
        uv = interpolate(self.snapshot.corner_uvs[triangle], barycentric)
        slant = np.maximum(np.abs(facing) / np.linalg.norm(geometric, axis=1), 0.1)
        footprint = hits.distance[hit] * spread / np.sqrt(slant) * self._uv_per_metre()[triangle]
        for index, material in enumerate(self.snapshot.materials):
            here = np.flatnonzero(self.snapshot.material_index[triangle] == index)
            albedo = np.tile(np.array(material.base_color, float) * material.diffuse_share, (len(here), 1))
            emission = np.tile(np.array(material.emission, float), (len(here), 1))
            for values, image in ((albedo, material.base_image), (emission, material.emission_image)):
                if image != NO_IMAGE:
                    values *= sample_image(self.snapshot.images[image], uv[here], footprint[here])[:, :3]
            if material.faint_gloss is not None:
                rows = np.repeat(faint_rows([material.faint_gloss]), len(here), axis=0)
                cosine = -np.einsum("ni,ni->n", surfaces.normal[hit[here]], direction[here])
                albedo = albedo_towards(rows, albedo, cosine)
            surfaces.albedo[hit[here]], surfaces.emission[hit[here]] = albedo, emission
        return surfaces

    def couplings(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(N, 4) how surfaces right below ``points`` take light of grazing angles, see core/faint_gloss.py."""
        return self.made_of(points, normals)[0]

    def made_of(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Couplings (N, 4) of surfaces right below ``points`` (N, 3), their mean albedo (N, 3) and material (N,), −1
        where they have no gloss that is sent evenly."""
        result = np.tile([0.0, 0.0, 0.0, 1.0], (len(points), 1)), np.zeros((len(points), 3)), np.full(len(points), -1)
        faint = [material.faint_gloss for material in self.snapshot.materials]
        if not any(faint):
            return result
        origins = rays.leave_surface(points, normals)
        hits = self.closest(origins, -normals)
        reach = COUPLING_SEARCH * np.linalg.norm(origins - points, axis=1)
        below = np.flatnonzero((hits.triangle >= 0) & (hits.distance < reach))
        number = self.snapshot.material_index[hits.triangle[below]]
        for index, material in enumerate(self.snapshot.materials):
            if material.faint_gloss is None:
                continue
            here = below[number == index]
            albedo = np.tile(np.array(material.base_color, float) * material.diffuse_share, (len(here), 1))
            if material.base_image != NO_IMAGE:
                albedo *= self._image(material.base_image, hits.triangle[here], hits.barycentric[here])[:, :3]
            rows = np.repeat(faint_rows([material.faint_gloss]), len(here), axis=0)
            result[0][here], result[1][here], result[2][here] = couplings(rows, albedo), albedo, index
        return result

    def _uv_per_metre(self) -> np.ndarray:
        """(T,) square root of a triangle's area in uv over its area in the world."""
        edge = self.triangles[:, 1:] - self.triangles[:, :1]
        uv_edge = self.snapshot.corner_uvs[:, 1:].astype(float) - self.snapshot.corner_uvs[:, :1]
        uv_area = np.abs(np.linalg.det(uv_edge))
        return np.sqrt(uv_area / np.maximum(np.linalg.norm(np.cross(edge[:, 0], edge[:, 1]), axis=1), 1e-30))


def interpolate(values: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """(N, C) blend of corner ``values`` (N, 3, C) by the weights of corners 1 and 2, (N, 2)."""
    first = 1 - barycentric.sum(axis=1, keepdims=True)
    return values[:, 0] * first + values[:, 1] * barycentric[:, :1] + values[:, 2] * barycentric[:, 1:]
