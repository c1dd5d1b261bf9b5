# SPDX-License-Identifier: GPL-3.0-or-later
"""The closed solids that the demo gallery is built from.

Every function returns a ``Solid``: a closed surface with outward normals (counter-clockwise faces), in metres. Solids
add up with ``+``; ``Solid.to_mesh`` makes the Blender mesh, with UVs projected along each face's main axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy  # first, because the wheel brings bmesh with it

import bmesh  # isort: skip
import numpy as np

TEXTURE_SIZE = 1.6  # metres of surface that one texture repeat covers


@dataclass
class Solid:
    """V vertices and F polygons; ``materials`` names the material of each face."""

    vertices: np.ndarray  # (V, 3) float
    faces: list[tuple[int, ...]]
    materials: list[str]
    smooth: bool = False

    def __add__(self, other: Solid) -> Solid:
        shift = len(self.vertices)
        moved = [tuple(index + shift for index in face) for face in other.faces]
        return Solid(
            np.concatenate([self.vertices, other.vertices]),
            self.faces + moved,
            self.materials + other.materials,
            self.smooth,
        )

    def at(self, x: float, y: float, z: float, turn: float = 0.0) -> Solid:
        """A copy turned by ``turn`` radians about Z, then moved to (x, y, z)."""
        c, s = np.cos(turn), np.sin(turn)
        turned = self.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return Solid(turned + (x, y, z), self.faces, self.materials, self.smooth)

    def to_mesh(self, name: str, materials: dict[str, bpy.types.Material]) -> bpy.types.Mesh:
        """A new mesh with the materials looked up by name and a UV layer in texture repeats."""
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(self.vertices.tolist(), [], self.faces)
        used = list(dict.fromkeys(self.materials))
        for material in used:
            mesh.materials.append(materials[material])
        slot = {material: index for index, material in enumerate(used)}
        mesh.polygons.foreach_set("material_index", [slot[material] for material in self.materials])
        mesh.polygons.foreach_set("use_smooth", np.full(len(self.faces), self.smooth))
        mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", _projected_uvs(mesh).ravel())
        mesh.update()
        return mesh


def _projected_uvs(mesh: bpy.types.Mesh) -> np.ndarray:
    """(L, 2) float32: corner positions in texture repeats, without the coordinate that the normal is largest in."""
    count = len(mesh.polygons)
    normals, totals = np.empty(count * 3, np.float32), np.empty(count, np.int32)
    mesh.polygons.foreach_get("normal", normals)
    mesh.polygons.foreach_get("loop_total", totals)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    positions = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", positions)
    axis = np.repeat(np.abs(normals.reshape(-1, 3)).argmax(axis=1), totals)
    kept = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    return np.take_along_axis(positions.reshape(-1, 3)[corners], kept, axis=1) / TEXTURE_SIZE


def box(low, high, material: str) -> Solid:
    """The axis-aligned box between corners ``low`` and ``high``."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    vertices = np.array([(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)], float)
    faces: list[tuple[int, ...]] = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return Solid(vertices, faces, [material] * 6)


def carved(outer: list[tuple], rooms: list[tuple], outside: str) -> Solid:
    """One closed solid: the union of the ``outer`` boxes, minus ``rooms``.

    ``outer`` holds (low, high); ``rooms`` holds (low, high, wall, floor, ceiling), and a later room wins where two
    overlap. Faces take the material that the room in front of them asks for, ``outside`` elsewhere. All boxes share one
    rectilinear lattice, so that neighbouring faces share their corners and no ray slips through a T-junction.
    """
    boxes = [*outer, *(room[:2] for room in rooms)]
    lines = [np.unique(np.round([corner[axis] for pair in boxes for corner in pair], 6)) for axis in range(3)]
    # One layer of empty cells all around, so that every solid cell has six neighbours.
    label = np.zeros([len(line) + 1 for line in lines], int)

    def cells(low, high):
        return tuple(
            slice(np.searchsorted(line, a - 1e-6) + 1, np.searchsorted(line, b - 1e-6) + 1)
            for line, a, b in zip(lines, low, high)
        )

    for low, high in outer:
        label[cells(low, high)] = -1
    for number, room in enumerate(rooms, 1):
        label[cells(*room[:2])] = number

    corners, faces, materials = [], [], []
    solid = np.argwhere(label == -1)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            neighbour = solid.copy()
            neighbour[:, axis] += 2 * side - 1
            front = label[tuple(neighbour.T)]
            bare = front != -1
            base = solid[bare] - 1  # lattice line at the low side of the cell
            base[:, axis] += side
            order = [(0, 0), (1, 0), (1, 1), (0, 1)] if side else [(0, 0), (0, 1), (1, 1), (1, 0)]
            for du, dv in order:
                corner = base.copy()
                corner[:, u] += du
                corner[:, v] += dv
                corners.append(corner)
            faces.append(int(bare.sum()))
            slot = 2 if axis != 2 else (3 if side else 4)
            materials += [rooms[number - 1][slot] if number else outside for number in front[bare]]

    quads = np.concatenate([np.stack(corners[4 * n : 4 * n + 4], axis=1) for n in range(6)])  # (F, 4, 3)
    lattice, index = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    vertices = np.stack([lines[axis][lattice[:, axis]] for axis in range(3)], axis=1)
    return Solid(vertices, [tuple(face) for face in index.reshape(-1, 4).tolist()], materials)


def lofted(sections: np.ndarray, material: str | list[str], closed: bool = False, smooth: bool = False) -> Solid:
    """Quads between consecutive sections: ``sections`` (N, S, 3) is the outline's S points at each of N stations.

    ``closed`` joins the last station to the first; otherwise both ends are capped. ``material`` is one name, or one for
    each of the outline's S sides (the caps take the first). The winding is turned outwards by the sign of the volume.
    """
    stations, sides = sections.shape[:2]
    names = [material] * sides if isinstance(material, str) else material
    spans = stations if closed else stations - 1
    n, s = (grid.ravel() for grid in np.meshgrid(np.arange(spans), np.arange(sides), indexing="ij"))
    after, beside = (n + 1) % stations, (s + 1) % sides
    quads = np.stack([n * sides + s, n * sides + beside, after * sides + beside, after * sides + s], axis=1)
    faces = [tuple(quad) for quad in quads.tolist()]
    materials = names * spans
    if not closed:
        last = (stations - 1) * sides
        faces += [tuple(range(sides - 1, -1, -1)), tuple(range(last, last + sides))]
        materials += [names[0]] * 2
    solid = Solid(sections.reshape(-1, 3).astype(float), faces, materials, smooth)
    if _signed_volume(solid) < 0:
        solid.faces = [face[::-1] for face in faces]
    return solid


def _signed_volume(solid: Solid) -> float:
    """m³, positive where faces wind counter-clockwise seen from outside (divergence theorem over fan triangles)."""
    fans = [(face[0], face[c], face[c + 1]) for face in solid.faces for c in range(1, len(face) - 1)]
    a, b, c = np.moveaxis((solid.vertices - solid.vertices.mean(axis=0))[np.array(fans)], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def circle(radius: float, sides: int) -> np.ndarray:
    """(sides, 2) points of a regular polygon."""
    angle = np.arange(sides) * 2 * np.pi / sides
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def turned(
    profile, material: str, sides: int = 24, twist: float = 0.0, lobes: int = 0, depth: float = 0.0, smooth: bool = True
) -> Solid:
    """A lathe shape: ``profile`` holds (radius, height) pairs, capped at both ends.

    ``twist`` radians of turn over the height and ``lobes`` waves of relative ``depth`` make it a twisted, fluted
    column.
    """
    profile = np.asarray(profile, float)
    turn = twist * (profile[:, 1] - profile[0, 1]) / np.ptp(profile[:, 1])
    angle = turn[:, None] + np.arange(sides) * 2 * np.pi / sides
    flute = 1 + depth * np.cos(lobes * (angle - turn[:, None]))
    radius = profile[:, :1] * flute
    height = np.broadcast_to(profile[:, 1:], radius.shape)
    return lofted(np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=2), material, smooth=smooth)


def spline(points, count: int) -> np.ndarray:
    """(count, 2) points of a Catmull-Rom curve through ``points`` (N, 2): a soft lathe profile."""
    points = np.asarray(points, float)
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    where = np.linspace(0, len(points) - 1, count)
    start = np.minimum(where.astype(int), len(points) - 2)
    t = (where - start)[:, None]
    p0, p1, p2, p3 = (padded[start + offset] for offset in range(4))
    return 0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * p1 - p0 - 3 * p2 + p3) * t**3)


def tube(path: np.ndarray, radius: float, sides: int, material: str, closed: bool = False) -> Solid:
    """A round bar along ``path`` (N, 3), its section carried along without twisting."""
    if closed:
        tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    else:
        tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.empty_like(path)
    start = np.cross(tangent[0], (0.3, 0.2, 0.93))
    for station, direction in enumerate(tangent):
        start = start - direction * (start @ direction)
        across[station] = start = start / np.linalg.norm(start)
    up = np.cross(tangent, across)
    if closed:  # spread the angle by which the carried section misses its start over the whole length
        end = across[-1] - tangent[0] * (across[-1] @ tangent[0])
        miss = np.arctan2(end @ up[0], end @ across[0])
        turn = -miss * np.arange(len(path))[:, None] / (len(path) - 1)
        across, up = across * np.cos(turn) + up * np.sin(turn), up * np.cos(turn) - across * np.sin(turn)
    ring = circle(radius, sides)
    sections = path[:, None] + ring[None, :, :1] * across[:, None] + ring[None, :, 1:] * up[:, None]
    return lofted(sections, material, closed, smooth=True)


def torus_knot(p: int, q: int, radius: float, tube_radius: float, stations: int, sides: int, material: str) -> Solid:
    """The (p, q) torus knot around the z axis, its lowest point at z = 0."""
    t = np.arange(stations) * 2 * np.pi / stations
    r = radius * (1 + 0.42 * np.cos(q * t))
    path = np.stack([r * np.cos(p * t), 0.52 * radius * np.sin(q * t), r * np.sin(p * t)], axis=1)
    solid = tube(path, tube_radius, sides, material, closed=True)
    solid.vertices[:, 2] -= solid.vertices[:, 2].min()
    return solid


def sphere(radius: float, subdivisions: int, material: str, smooth: bool = True) -> Solid:
    """An icosphere resting on z = 0."""
    made = bmesh.new()
    bmesh.ops.create_icosphere(made, subdivisions=subdivisions, radius=radius)
    vertices = np.array([vertex.co for vertex in made.verts]) + (0, 0, radius)
    faces = [tuple(vertex.index for vertex in face.verts) for face in made.faces]
    made.free()
    return Solid(vertices, faces, [material] * len(faces), smooth)


def ring_moulding(low, high, profile, material: str) -> Solid:
    """A moulding along the four walls of the rectangle ``low``–``high`` (x, y), mitred at the corners.

    ``profile`` holds (projection from the wall, z) pairs of the closed outline.
    """
    profile = np.asarray(profile, float)
    sections = []
    for x, y, sx, sy in (
        (low[0], low[1], 1, 1),
        (high[0], low[1], -1, 1),
        (high[0], high[1], -1, -1),
        (low[0], high[1], 1, -1),
    ):
        sections.append(np.stack([x + sx * profile[:, 0], y + sy * profile[:, 0], profile[:, 1]], axis=1))
    return lofted(np.array(sections), material, closed=True)


def arch_curve(half_width: float, spring: float, rise: float, count: int) -> np.ndarray:
    """(count, 2) points (y, z) of a half ellipse from −half_width to half_width that springs at z = ``spring``."""
    angle = np.linspace(np.pi, 0, count)
    return np.stack([half_width * np.cos(angle), spring + rise * np.sin(angle)], axis=1)


def arch_filling(
    x0: float, x1: float, half_width: float, spring: float, rise: float, top: float, materials: tuple[str, str, str]
) -> Solid:
    """What turns a rectangular opening up to ``top`` in the wall x0–x1 into an arch.

    ``materials``: face towards −x, face towards +x, soffit.
    """
    curve = arch_curve(half_width, spring, rise, 17)
    y, z = curve.T
    upper = np.full_like(y, top)
    corners = [(x0, z), (x1, z), (x1, upper), (x0, upper)]
    sections = np.stack([np.stack([np.full_like(y, x), y, height], axis=1) for x, height in corners], axis=1)
    minus, plus, soffit = materials
    return lofted(sections, [soffit, plus, soffit, minus])


def arch_frame(
    x0: float, x1: float, half_width: float, foot: float, spring: float, rise: float, width: float, material: str
) -> Solid:
    """A moulding of ``width`` around an arched opening, from x0 to x1, standing on z = ``foot``."""

    def outline(grow):
        curve = arch_curve(half_width + grow, spring, rise + grow, 17)
        ends = np.array([[-half_width - grow, foot]]), np.array([[half_width + grow, foot]])
        return np.concatenate([ends[0], curve, ends[1]])

    corners = [(x0, outline(0.0)), (x1, outline(0.0)), (x1, outline(width)), (x0, outline(width))]
    sections = np.stack([np.concatenate([np.full((len(line), 1), x), line], axis=1) for x, line in corners], axis=1)
    return lofted(sections, material)


def coffered_vault(
    x0: float,
    x1: float,
    half_width: float,
    spring: float,
    rise: float,
    top: float,
    coffers: tuple[int, int],
    materials: tuple[str, str],
) -> Solid:
    """A segmental barrel vault along x whose underside carries ``coffers`` (along x, along the arc).

    The solid fills everything between the underside and z = ``top``. ``materials``: ribs, panels.
    """
    radius = (half_width**2 + rise**2) / (2 * rise)
    opening = np.arcsin(half_width / radius)
    angle = np.linspace(-opening, opening, coffers[1] + 1)
    arc = np.stack([radius * np.sin(angle), spring + rise - radius * (1 - np.cos(angle))], axis=1)
    outline = np.concatenate([arc, [[half_width, top], [-half_width, top]]])
    stations = np.linspace(x0, x1, coffers[0] + 1)
    sections = np.stack([np.concatenate([np.full((len(outline), 1), x), outline], axis=1) for x in stations])
    rib, panel = materials
    base = lofted(sections, [panel] * coffers[1] + [rib] * 3)

    made = bmesh.new()
    vertices = [made.verts.new(vertex) for vertex in base.vertices]
    underside = []
    for face, material in zip(base.faces, base.materials):
        polygon = made.faces.new([vertices[index] for index in face])
        if material == panel and len(face) == 4:
            underside.append(polygon)
    made.normal_update()
    size = min((x1 - x0) / coffers[0], radius * 2 * opening / coffers[1])
    for thickness, depth in (
        (0.14 * size, 0.0),
        (0.02 * size, -0.08 * size),
        (0.08 * size, 0.0),
        (0.02 * size, -0.08 * size),
    ):
        bmesh.ops.inset_individual(made, faces=underside, thickness=thickness, depth=depth)
    made.verts.index_update()
    panels = set(underside)
    solid = Solid(
        np.array([vertex.co for vertex in made.verts]),
        [tuple(vertex.index for vertex in face.verts) for face in made.faces],
        [panel if face in panels else rib for face in made.faces],
    )
    made.free()
    return solid


def spiral_stair(height: float, steps: int, sweep: float, inner: float, outer: float, tread: str, metal: str) -> Solid:
    """A spiral stair around the z axis from z = 0, ``steps`` risers over ``sweep`` radians, with a railing."""
    solid = turned([(inner, 0.0), (inner, height + 0.95)], metal, sides=12)
    step = sweep / steps
    rise = height / steps
    bends = np.linspace(-0.04, step + 0.04, 4)
    for index in range(steps):
        angle = index * step + bends
        top = (index + 1) * rise
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        sections = np.stack(
            [
                np.concatenate([ring * r, np.full((4, 1), z)], axis=1)
                for r, z in ((inner * 0.8, top - 0.06), (outer, top - 0.06), (outer, top), (inner * 0.8, top))
            ],
            axis=1,
        )
        solid = solid + lofted(sections, tread)
        middle = (index + 0.5) * step
        x, y = (outer - 0.05) * np.cos(middle), (outer - 0.05) * np.sin(middle)
        baluster = turned([(0.012, top), (0.012, top + 0.9)], metal, sides=6)
        solid = solid + baluster.at(x, y, 0)
    angle = np.linspace(0.5 * step, sweep - 0.5 * step, 2 * steps)
    climb = np.linspace(rise, height, 2 * steps) + 0.9
    rail = np.stack([(outer - 0.05) * np.cos(angle), (outer - 0.05) * np.sin(angle), climb], axis=1)
    solid = solid + tube(rail, 0.025, 8, metal)
    solid.smooth = False
    return solid


def balustrade(start, end, z: float, height: float, material: str, spacing: float = 0.32) -> Solid:
    """Turned balusters between a plinth and a handrail from ``start`` to ``end`` (x, y), one of them equal in x or
    y."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = end - start
    across = np.array([along[1] != 0, along[0] != 0], float) * 0.07
    low, high = np.minimum(start, end) - across, np.maximum(start, end) + across
    solid = box((*low, z), (*high, z + 0.1), material) + box((*low, z + height - 0.09), (*high, z + height), material)
    profile = np.array([(0.042, 0.0), (0.028, 0.12), (0.06, 0.34), (0.022, 0.74), (0.042, 1.0)])
    profile[:, 1] = z + 0.1 + profile[:, 1] * (height - 0.19)
    count = max(int(np.linalg.norm(along) / spacing), 1)
    for place in (np.arange(count) + 0.5) / count:
        x, y = start + place * along
        solid = solid + turned(profile, material, sides=7).at(x, y, 0)
    return solid
