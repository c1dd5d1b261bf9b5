# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands and hangs in the demo gallery: pictures, sculptures, plinths, benches and wall lamps.

Each function returns a ``Solid`` around its own origin: things that stand have it at their foot, things that hang at
the wall behind their middle, facing −y.
"""

from __future__ import annotations

import bpy
import numpy as np

from .gallery_shapes import Solid, box, lofted, sphere, spline, torus_knot, turned


def frame(width: float, height: float, material: str = "Gilding", size: float = 1.0) -> Solid:
    """A moulded frame around a picture of ``width`` × ``height``; ``size`` 1 is 9 cm wide and 6 cm deep."""
    # outwards, off the wall
    profile = size * np.array([(0.0, 0.0), (0.09, 0.0), (0.09, 0.035), (0.06, 0.06), (0.03, 0.05), (0.0, 0.03)])
    w, h = width / 2, height / 2
    sections = [
        np.stack([sx * (w + profile[:, 0]), -profile[:, 1], sz * (h + profile[:, 0])], axis=1)
        for sx, sz in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return lofted(np.array(sections), material, closed=True)


def picture_mesh(name: str, width: float, height: float, materials: dict[str, bpy.types.Material]) -> bpy.types.Mesh:
    """A board with the painting ``name`` stretched over its front."""
    board = box((-width / 2, -0.025, -height / 2), (width / 2, 0, height / 2), name)
    mesh = board.to_mesh(name, materials)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    x, _, z = board.vertices[corners].T
    uvs = np.stack([x / width + 0.5, z / height + 0.5], axis=1)
    mesh.uv_layers["UVMap"].uv.foreach_set("vector", uvs.astype(np.float32).ravel())
    return mesh


def wall_lamp() -> Solid:
    """A half-round alabaster bowl between two gilded bands, 0.3 m deep."""
    angle = np.linspace(np.pi, 2 * np.pi, 13)
    parts = None
    for low, high, radius, material in (
        (-0.34, -0.28, 0.24, "Gilding"),
        (-0.28, 0.28, 0.22, "Alabaster glow"),
        (0.28, 0.34, 0.24, "Gilding"),
    ):
        bow = np.stack([radius * np.cos(angle), 1.25 * radius * np.sin(angle)], axis=1)
        sections = np.stack([np.concatenate([bow, np.full((len(bow), 1), z)], axis=1) for z in (low, high)])
        part = lofted(sections, material)
        parts = part if parts is None else parts + part
    return parts


def light_panel() -> Solid:
    """A tall backlit panel: large and mild, as a grid of probes likes its light sources."""
    return box((-0.4, -0.05, -0.85), (0.4, 0, 0.85), "Panel glow") + frame(0.8, 1.7, "Walnut", 0.95)


def plinth(size: float, height: float, material: str = "Limestone") -> Solid:
    """A square pedestal with base and cap."""
    half = size / 2
    solid = box((-half - 0.04, -half - 0.04, 0), (half + 0.04, half + 0.04, 0.1), material)
    solid = solid + box((-half, -half, 0.1), (half, half, height - 0.06), material)
    return solid + box((-half - 0.03, -half - 0.03, height - 0.06), (half + 0.03, half + 0.03, height), material)


def bench() -> Solid:
    """An upholstered gallery bench, 1.8 m × 0.5 m."""
    solid = box((-0.9, -0.25, 0.36), (0.9, 0.25, 0.40), "Walnut")
    for x in (-0.72, 0.72):
        solid = solid + box((x - 0.04, -0.22, 0), (x + 0.04, 0.22, 0.36), "Walnut")
    for x in (-0.6, 0.0, 0.6):
        cushion = [(x - 0.29, x + 0.29, 0.24, 0.40), (x - 0.29, x + 0.29, 0.24, 0.46), (x - 0.25, x + 0.25, 0.2, 0.48)]
        sections = np.array([[(x0, -y, z), (x1, -y, z), (x1, y, z), (x0, y, z)] for x0, x1, y, z in cushion])
        solid = solid + lofted(sections, "Leather")
    return solid


def wall_panel(width: float, height: float) -> Solid:
    """A painted field in a slim moulding, flat enough to be wall."""
    w, h = width / 2, height / 2
    return box((-w, -0.012, -h), (w, 0, h), "Panel") + frame(width, height, "Plaster", 0.5)


def knot() -> Solid:
    """A trefoil knot in ultramarine."""
    return torus_knot(2, 3, 0.46, 0.105, 96, 10, "Ultramarine")


def twisted_column() -> Solid:
    """A fluted marble column that turns and swells as it rises."""
    profile = spline([(0.20, 0.0), (0.26, 0.25), (0.17, 0.7), (0.23, 1.1), (0.05, 1.5)], 24)
    return turned(profile, "Marble", sides=25, twist=2.2, lobes=5, depth=0.16)


def amphora(material: str = "Terracotta") -> Solid:
    """A tall vase."""
    profile = spline(
        [(0.10, 0.0), (0.12, 0.03), (0.27, 0.38), (0.20, 0.62), (0.075, 0.74), (0.085, 0.84), (0.13, 0.9)], 20
    )
    return turned(profile, material, sides=20)


def spheres() -> Solid:
    """Three touching marble balls, one on two."""
    solid = sphere(0.20, 3, "Marble").at(-0.2, 0, 0) + sphere(0.20, 3, "Marble").at(0.2, 0, 0)
    return solid + sphere(0.16, 3, "Celadon").at(0, 0, 0.2 + np.sqrt(0.36**2 - 0.2**2) - 0.16)


def lay_light(width: float, depth: float, rods: float = 0.0) -> Solid:
    """The frame of a luminous panel that hangs on ``rods`` metres; its underside is z = 0."""
    solid = box((-width / 2, -depth / 2, 0.0), (width / 2, depth / 2, 0.06), "Ceiling")
    for x in (-width / 2 + 0.2, width / 2 - 0.2) if rods else ():
        for y in (-depth / 2 + 0.15, depth / 2 - 0.15):
            solid = solid + turned([(0.012, 0.06), (0.012, 0.06 + rods)], "Iron", sides=6).at(x, y, 0)
    return solid
