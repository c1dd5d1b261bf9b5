# SPDX-License-Identifier: GPL-3.0-or-later
"""Emissive surfaces that are sampled like lights, because rays at random would miss them.

Rays between patches and the texels of probes find a luminous ceiling often enough; of a lamp smaller than a cell they
hit too little, or nothing. Emitters smaller than a cell are therefore sampled: as lights at patches, and as extra
directions in the probes themselves, where one ray per texel may miss them. So are those that are a small part of all
surface, such as a screen in a room: the few rays of a patch find them too seldom, however many cells they fill.
"""

from __future__ import annotations

import numpy as np

from .conventions import LUMINANCE
from .grid import Grid
from .kept import Kept
from .light_links import link_roles
from .snapshot import SceneSnapshot
from .triangles import areas

CANDIDATES = 8  # points on emitters, of which a surface's shadow ray goes to one
PROBE_POINTS = 4096  # on emitters that each probe considers besides its texels
EMITTER_BOXES = 8  # around all of them, by which points know that none is near
PROBE_RAYS = 256  # that it sends to them
_MOST_AREA_SHARE = 0.25  # of all surface: a scene that glows all over is resolved by any grid
_SELDOM_SHARE = 0.05  # of all surface: of a hundred rays five would find it


def sampling_density(snapshot: SceneSnapshot, grid: Grid) -> np.ndarray:
    """(T,) probability density per m² with which a point on each triangle is chosen as a light sample; integrates to 1.

    Proportional to luminance of the emission; 0 everywhere where nothing is sampled. An object's emission is sampled
    when the area that glows is no larger than the square of a cell's diagonal, or a small share of all surface; and
    where light linking lets it pass surfaces, at which rays at random end.
    """
    luminance = _luminance(snapshot)[snapshot.material_index]
    density = np.zeros(len(snapshot.triangles))
    glowing = np.flatnonzero(luminance > 0)
    if not len(glowing):
        return density
    area = _areas(snapshot.vertices, snapshot.triangles)
    per_object = np.bincount(snapshot.object_index[glowing], area[glowing], len(snapshot.object_names))
    most = max(float((grid.cell_size() ** 2).sum()), _SELDOM_SHARE * float(area.sum()))
    passing = _passing(snapshot)[snapshot.material_index[glowing]]
    small = per_object[snapshot.object_index[glowing]] <= most
    if area[glowing[small]].sum() > _MOST_AREA_SHARE * area.sum():
        small[:] = False
    sampled = glowing[(small | passing) & (area[glowing] > 0)]
    power = area[sampled] * luminance[sampled]
    if power.sum() > 0:
        density[sampled] = luminance[sampled] / power.sum()
    return density


_areas = Kept(lambda vertices, triangles: areas(vertices[triangles]))


def reach(density: np.ndarray) -> float:
    """Metres within which surfaces look for emitters of ``density`` (T,) in directions about the normal: nearer than
    this a direction finds an emitter at least as often as one of CANDIDATES points falls there. 0 without emitters."""
    sampled = density[density > 0]
    return float((np.pi * CANDIDATES * sampled.min()) ** -0.5) if len(sampled) else 0.0


def _passing(snapshot: SceneSnapshot) -> np.ndarray:
    """(M,) bool: there are surfaces that do not block the light of each material; at least one entry."""
    roles = link_roles([material.links for material in snapshot.materials])
    return ~roles.blocks.all(axis=0)[roles.group[roles.of_surface]]


def _luminance(snapshot: SceneSnapshot) -> np.ndarray:
    """(M,) mean luminance that each material emits; at least one entry."""
    values = np.zeros(max(len(snapshot.materials), 1))
    for index, material in enumerate(snapshot.materials):
        emission = np.maximum(np.array(material.emission, float), 0.0)
        if material.emission_image >= 0:
            emission = emission * snapshot.images[material.emission_image].pixels[..., :3].mean(axis=(0, 1))
        values[index] = emission @ LUMINANCE
    return values
