# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated meshes and their instances as world-space triangles.

Every mesh datablock is read once, whatever the number of its instances, in its own space and with bulk reads only;
instances are transformed together in float64.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import prod

import bpy
import numpy as np

from ..core.triangles import cross

# A triangle thinner than this share of its longest edge has no area that light could fall on.
_NEEDLE = 1e-7


@dataclass
class MeshArrays:
    """One mesh in its own space, triangulated. V vertices, T triangles."""

    vertices: np.ndarray  # (V, 3) float64
    triangles: np.ndarray  # (T, 3) int32
    corner_normals: np.ndarray  # (T, 3, 3) float32
    slots: np.ndarray  # (T,) int32 material slot
    uv_maps: dict[str, np.ndarray]  # name -> (T, 3, 2) float32
    active_uv_map: str  # "" where the mesh has none
    attributes: dict[str, np.ndarray] = field(default_factory=dict)  # those asked for -> (T, 3, 1 to 4) float32
    texture_location: np.ndarray = field(default_factory=lambda: np.zeros(3))  # of Generated coordinates
    texture_size: np.ndarray = field(default_factory=lambda: np.ones(3))
    not_finite: int = 0  # triangles dropped because a corner is NaN or infinite
    needles: int = 0  # triangles dropped because they have no area


@dataclass
class WorldTriangles:
    """The arrays of ``SceneSnapshot`` that describe one group of instances; I instances of one mesh."""

    vertices: np.ndarray  # (I·V, 3) float64
    triangles: np.ndarray  # (I·T, 3) int32
    corner_normals: np.ndarray  # (I·T, 3, 3) float32
    corner_uvs: np.ndarray  # (I·T, 3, 2) float32


@dataclass
class MeshCopy:
    """A mesh as Blender has it, copied while its depsgraph lives. V vertices, C corners, F faces, T triangles."""

    vertices: np.ndarray  # (V, 3) float32
    corner_vertices: np.ndarray  # (C,) int32
    first_corners: np.ndarray | None  # (F,) int32 of faces; None where every face is a triangle
    corners: np.ndarray | None  # (T, 3) int32 corners of triangles; None where no face has more than four corners
    faces: np.ndarray | None  # (T,) int32, as ``corners``
    normals_domain: str  # "POINT", "CORNER" or "FACE": what ``normals`` are of
    normals: np.ndarray  # (N, 3) float32
    slots: np.ndarray | None  # (F,) int32 material slot; None while every face uses the first
    uv_maps: dict[str, np.ndarray]  # name -> (C, 2) float32
    active_uv_map: str
    attributes: dict[str, tuple[str, np.ndarray]]  # name -> domain, (N, 1 to 4)
    texture_location: np.ndarray
    texture_size: np.ndarray


def copy_mesh(mesh: bpy.types.Mesh, attributes: Iterable[str] = ()) -> MeshCopy:
    """What is needed of an evaluated mesh: bulk reads and nothing else, for Blender waits meanwhile.

    ``attributes`` names those that its materials ask for, "" the colours that renders show.
    """
    first_corners = corners = faces = None
    if len(mesh.loops) != 3 * len(mesh.polygons):  # else they are triangles already
        first_corners = _read(mesh.polygons, "loop_start", (len(mesh.polygons),), np.int32)
        if np.diff(first_corners, append=np.int32(len(mesh.loops))).max() > 4:
            # Handed over one by one, which takes four times as long as all the rest.
            mesh.calc_loop_triangles()
            count = len(mesh.loop_triangles)
            corners = _read(mesh.loop_triangles, "loops", (count, 3), np.int32)
            faces = _read(mesh.loop_triangle_polygons, "value", (count,), np.int32)
    return MeshCopy(
        vertices=(
            _read(mesh.attributes["position"].data, "vector", (len(mesh.vertices), 3), np.float32)
            if mesh.vertices
            else np.empty((0, 3), np.float32)
        ),
        corner_vertices=(
            _read(mesh.attributes[".corner_vert"].data, "value", (len(mesh.loops),), np.int32)
            if mesh.loops
            else np.empty(0, np.int32)
        ),
        first_corners=first_corners,
        corners=corners,
        faces=faces,
        normals_domain=mesh.normals_domain,
        normals=_normals(mesh),
        slots=_face_slots(mesh),
        uv_maps={
            layer.name: _read(mesh.attributes[layer.name].data, "vector", (len(mesh.loops), 2), np.float32)
            for layer in mesh.uv_layers
        },
        active_uv_map=next((layer.name for layer in mesh.uv_layers if layer.active_render), ""),
        attributes=_attributes(mesh, attributes),
        texture_location=np.array(mesh.texspace_location, float),
        texture_size=np.array(mesh.texspace_size, float),
    )


def triangulated(copy: MeshCopy) -> MeshArrays:
    """The triangles of a mesh. Those without area and those with a corner that is not finite are dropped and
    counted."""
    corners, faces = copy.corners, copy.faces
    if corners is None or faces is None:
        corners, faces = _split_quads(copy)
    triangles = copy.corner_vertices[corners]
    elements = {"POINT": triangles, "CORNER": corners, "FACE": np.broadcast_to(faces[:, None], corners.shape)}
    arrays = MeshArrays(
        vertices=copy.vertices.astype(float),
        triangles=triangles,
        corner_normals=copy.normals[elements[copy.normals_domain]],
        slots=np.zeros(len(faces), np.int32) if copy.slots is None else copy.slots[faces],
        uv_maps={name: _finite(uvs)[corners] for name, uvs in copy.uv_maps.items()},
        active_uv_map=copy.active_uv_map,
        attributes={
            name: _finite(values.astype(np.float32))[elements[domain]]
            for name, (domain, values) in copy.attributes.items()
            if domain in elements
        },
        texture_location=copy.texture_location,
        texture_size=copy.texture_size,
    )
    _drop_unusable(arrays)
    return arrays


def _split_quads(copy: MeshCopy) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) int32 corners of the triangles of a mesh of triangles and quads, and (T,) int32 the face of each, as
    Blender and Cycles split them: along the first and third corner, unless the other two lie on one side of that line,
    as in a quad with a notch or folded over."""
    if copy.first_corners is None:
        count = len(copy.corner_vertices) // 3
        return np.arange(3 * count, dtype=np.int32).reshape(-1, 3), np.arange(count, dtype=np.int32)
    first = copy.first_corners
    is_quad = np.diff(first, append=np.int32(len(copy.corner_vertices))) == 4
    quads = first[is_quad]
    a, b, c, d = (copy.vertices[copy.corner_vertices[quads + corner]] for corner in range(4))
    with np.errstate(invalid="ignore", over="ignore"):  # corners that are not finite are dropped later
        diagonal = c - a
        other = np.einsum("qi,qi->q", cross(b - a, diagonal), cross(d - a, diagonal)) > 0
    split = np.where(other[:, None, None], [[0, 1, 3], [1, 2, 3]], [[0, 1, 2], [0, 2, 3]])
    faces = np.repeat(np.arange(len(first), dtype=np.int32), 1 + is_quad)
    corners = first[faces, None] + np.arange(3, dtype=np.int32)
    corners[is_quad[faces]] = (quads[:, None, None] + split).reshape(-1, 3)
    return corners, faces


def place(mesh: MeshArrays, corner_uvs: np.ndarray, matrices: np.ndarray) -> WorldTriangles:
    """Put instances of ``mesh`` into the world; ``matrices`` is (I, 4, 4) float64, ``corner_uvs`` (T, 3, 2) float32.

    Mirroring transforms reverse the winding, so that triangles stay counter-clockwise from their front; normals go
    through the inverse transpose, written with cofactors because that also holds for flattening transforms.
    """
    count, (vertex_count, triangle_count) = len(matrices), (len(mesh.vertices), len(mesh.triangles))
    axes = matrices[:, :3, :3]
    vertices = mesh.vertices @ axes.transpose(0, 2, 1) + matrices[:, None, :3, 3]
    mirrored = np.linalg.det(axes) < 0
    cofactors = np.cross(axes[:, :, [1, 2, 0]], axes[:, :, [2, 0, 1]], axis=1)  # columns b×c, c×a, a×b
    cofactors *= np.where(mirrored, -1.0, 1.0)[:, None, None]
    # Scaled so that millimetre and kilometre scales stay within float32 before they are normalised.
    largest = np.abs(cofactors).max(axis=(1, 2), keepdims=True)
    cofactors /= np.where(largest > 0, largest, 1.0)
    normals = mesh.corner_normals.reshape(-1, 3) @ cofactors.transpose(0, 2, 1).astype(np.float32)
    normals = normals.reshape(count, triangle_count, 3, 3)

    triangles = np.repeat(mesh.triangles[None], count, axis=0)
    triangles[mirrored] = triangles[mirrored][:, :, [0, 2, 1]]
    normals[mirrored] = normals[mirrored][:, :, [0, 2, 1]]
    uvs = np.repeat(corner_uvs[None], count, axis=0)
    uvs[mirrored] = uvs[mirrored][:, :, [0, 2, 1]]
    triangles += (np.arange(count, dtype=np.int32) * vertex_count)[:, None, None]
    world = WorldTriangles(
        vertices.reshape(-1, 3), triangles.reshape(-1, 3), normals.reshape(-1, 3, 3), uvs.reshape(-1, 3, 2)
    )
    _normalise(world)
    return world


def _read(collection, attribute: str, shape: tuple[int, ...], dtype) -> np.ndarray:
    values = np.empty(prod(shape), dtype)
    collection.foreach_get(attribute, values)
    return values.reshape(shape)


def _normals(mesh: bpy.types.Mesh) -> np.ndarray:
    """(N, 3) float32, in the cheapest domain that holds them all."""
    if not mesh.loops:
        return np.empty((0, 3), np.float32)
    if mesh.normals_domain == "POINT":
        return _read(mesh.vertex_normals, "vector", (len(mesh.vertices), 3), np.float32)
    if mesh.normals_domain == "FACE":
        return _read(mesh.polygon_normals, "vector", (len(mesh.polygons), 3), np.float32)
    return _read(mesh.corner_normals, "vector", (len(mesh.loops), 3), np.float32)


def _face_slots(mesh: bpy.types.Mesh) -> np.ndarray | None:
    attribute: bpy.types.Attribute | None = mesh.attributes.get("material_index")
    if attribute is None or attribute.domain != "FACE" or attribute.data_type != "INT":
        return None
    return _read(attribute.data, "value", (len(mesh.polygons),), np.int32)


def _finite(values: np.ndarray) -> np.ndarray:
    """``values``, or a copy with 0 for what is not finite."""
    return values if np.isfinite(values).all() else np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)


# How the values of an attribute are read: property of its elements and channels.
_VALUES = {
    "FLOAT": ("value", 1),
    "INT": ("value", 1),
    "INT8": ("value", 1),
    "BOOLEAN": ("value", 1),
    "FLOAT2": ("vector", 2),
    "FLOAT_VECTOR": ("vector", 3),
    "FLOAT_COLOR": ("color", 4),
    "BYTE_COLOR": ("color", 4),
}


def _attributes(mesh: bpy.types.Mesh, names: Iterable[str]) -> dict[str, tuple[str, np.ndarray]]:
    """Those of ``names`` that ``mesh`` has, linear where they are colours: name -> domain, (N, channels)."""
    found: dict[str, tuple[str, np.ndarray]] = {}
    for name in names:
        index = mesh.color_attributes.render_color_index
        layer: bpy.types.Attribute | None = mesh.attributes.get(name) if name else None
        if not name and 0 <= index < len(mesh.color_attributes):
            layer = mesh.color_attributes[index]
        if layer is None or layer.data_type not in _VALUES:
            continue
        attribute, channels = _VALUES[layer.data_type]
        kind = {"INT": np.int32, "INT8": np.int32, "BOOLEAN": bool}.get(layer.data_type, np.float32)
        found[name] = layer.domain, _read(layer.data, attribute, (len(layer.data), channels), kind)
    return found


def _drop_unusable(mesh: MeshArrays) -> None:
    """Remove triangles that are not finite or have no area, and the vertices that are not finite."""
    finite = np.isfinite(mesh.vertices).all(axis=1)
    keep = np.ones(len(mesh.triangles), bool)
    if not finite.all():
        keep = finite[mesh.triangles].all(axis=1)
        mesh.not_finite = int(len(keep) - keep.sum())
    usable = keep.copy()
    usable[keep] = _has_area(mesh.vertices, mesh.triangles[keep])
    mesh.needles = int(keep.sum() - usable.sum())
    if not usable.all():
        mesh.triangles, mesh.slots = mesh.triangles[usable], mesh.slots[usable]
        mesh.corner_normals = mesh.corner_normals[usable]
        mesh.uv_maps = {name: uvs[usable] for name, uvs in mesh.uv_maps.items()}
        mesh.attributes = {name: values[usable] for name, values in mesh.attributes.items()}
    if not finite.all():
        mesh.triangles = (np.cumsum(finite, dtype=np.int32) - 1)[mesh.triangles]
        mesh.vertices = mesh.vertices[finite]


def _has_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(T,) bool."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    ab, ac, bc = b - a, c - a, c - b
    doubled_area = np.linalg.norm(cross(ab, ac), axis=1)
    longest = np.maximum(np.maximum((ab * ab).sum(1), (ac * ac).sum(1)), (bc * bc).sum(1))
    return doubled_area > _NEEDLE * longest


def _normalise(world: WorldTriangles) -> None:
    """Give corner normals unit length; where there is none, the triangle's own normal stands in."""
    lengths = np.sqrt(np.einsum("tci,tci->tc", world.corner_normals, world.corner_normals))
    missing = ~((lengths > 1e-12) & np.isfinite(lengths))
    if missing.any():
        rows = np.flatnonzero(missing.any(axis=1))
        a, b, c = (world.vertices[world.triangles[rows, corner]] for corner in range(3))
        normals = cross(b - a, c - a)
        sizes = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = np.where(sizes > 0, normals / np.where(sizes > 0, sizes, 1), [0.0, 0.0, 1.0]).astype(np.float32)
        world.corner_normals[missing] = np.repeat(normals[:, None], 3, axis=1)[missing[rows]]
        lengths = np.where(missing, np.float32(1), lengths)
    world.corner_normals /= lengths[..., None]
