# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a texture lies: UV maps and the affine nodes between them and a texture."""

from __future__ import annotations

import numpy as np

from .node_links import Unsupported, find_socket, resolve
from .shader_values import Domain


def domain_of(evaluator, socket, scope, extension: str) -> Domain:
    """The domain of a texture whose Vector input is ``socket``.

    Raises:
        Unsupported: the coordinates are not an affine function of one UV map.
    """
    uv_map, matrix = affine_coordinates(evaluator, socket, scope, _uv_map_of)
    # (u, v, 0) goes in and the first two rows come out: rotations around X and Y only squash the picture.
    return Domain(uv_map, tuple(float(value) for value in matrix[:2][:, [0, 1, 3]].ravel()), extension)


def affine_coordinates(evaluator, socket, scope, origin_of) -> tuple[str, np.ndarray]:
    """(origin, (4, 4) matrix on it) of the vector that arrives at the input ``socket``.

    Args:
        origin_of: called with an output socket, or None for a socket left to its default; names the coordinates that it
            hands out, or returns None where they are not the ones that are asked for.

    Raises:
        Unsupported: the vector is no affine function of such coordinates.
    """
    source, scope = resolve(socket, scope)
    origin = origin_of(source if source.is_output else None)
    if origin is not None:
        return origin, np.eye(4)
    node = source.node
    if node.bl_idname in _AFFINE:
        return _AFFINE[node.bl_idname](evaluator, node, scope, origin_of)
    if node.bl_idname == "ShaderNodeTexCoord":
        raise Unsupported(f"{source.name} coordinates")
    raise Unsupported(f"coordinates from '{node.name}'")


def _uv_map_of(source) -> str | None:
    """The UV map that an output hands out; "" is the active one, which image textures also take by default."""
    if source is None or (source.node.bl_idname == "ShaderNodeTexCoord" and source.name == "UV"):
        return ""
    if source.node.bl_idname == "ShaderNodeUVMap" and not source.node.from_instancer:
        return source.node.uv_map
    if (
        source.node.bl_idname == "ShaderNodeAttribute"
        and source.name == "Vector"
        and source.node.attribute_type == "GEOMETRY"
    ):
        return source.node.attribute_name
    return None


def _mapping(evaluator, node, scope, origin_of):
    origin, matrix = affine_coordinates(evaluator, find_socket(node.inputs, "Vector"), scope, origin_of)
    rotation, scale = _rotation(_fixed(evaluator, node, "Rotation", scope)), _fixed(evaluator, node, "Scale", scope)
    if node.vector_type == "NORMAL":
        raise Unsupported("a Mapping node of type Normal")
    own = np.eye(4)
    if node.vector_type == "TEXTURE":
        inverse_scale = np.divide(1.0, scale, out=np.zeros(3), where=scale != 0)
        own[:3, :3] = inverse_scale[:, None] * rotation.T
        own[:3, 3] = -own[:3, :3] @ _fixed(evaluator, node, "Location", scope)
    else:
        own[:3, :3] = rotation * scale
        if node.vector_type == "POINT":
            own[:3, 3] = _fixed(evaluator, node, "Location", scope)
    return origin, own @ matrix


def _vector_math(evaluator, node, scope, origin_of):
    origin, matrix = affine_coordinates(evaluator, node.inputs[0], scope, origin_of)
    own = np.eye(4)
    if node.operation == "SCALE":
        own[:3, :3] *= _fixed(evaluator, node, "Scale", scope)[0]
    elif node.operation in ("ADD", "SUBTRACT"):
        own[:3, 3] = _fixed(evaluator, node, "Vector_001", scope) * (1 if node.operation == "ADD" else -1)
    elif node.operation == "MULTIPLY":
        own[:3, :3] *= _fixed(evaluator, node, "Vector_001", scope)[:, None]
    else:
        raise Unsupported(f"Vector Math {node.operation.title()} on coordinates")
    return origin, own @ matrix


_AFFINE = {"ShaderNodeMapping": _mapping, "ShaderNodeVectorMath": _vector_math}


def _fixed(evaluator, node, name: str, scope) -> np.ndarray:
    """(3,) value of an input that must be the same everywhere."""
    value = evaluator.input(node, name, scope)
    if not value.is_constant:
        raise Unsupported(f"'{name}' of '{node.name}' changes over the surface")
    return value.rgb()


def _rotation(euler: np.ndarray) -> np.ndarray:
    """(3, 3) matrix of XYZ Euler angles in radians."""
    (sx, sy, sz), (cx, cy, cz) = np.sin(euler), np.cos(euler)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x
