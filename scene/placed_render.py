# SPDX-License-Identifier: GPL-3.0-or-later
"""What a socket of a material evaluates to at given places of surfaces, rendered by Cycles: one small quad a place.

The quads lie side by side in one plane and carry what shader nodes ask of a place as attributes of their faces. In a
copy of the material those nodes are replaced by Attribute nodes, in node groups too, so every texture and every chain
of nodes gives what it gives on the surface itself. Nodes that depend on the ray are answered as in ``shader_nodes``.
"""

from __future__ import annotations

import bpy
import numpy as np

from .albedos import fresnel_mean
from .cycles_reference import unbiased_settings
from .flat_render import exposed_in_groups, show_alone
from .node_links import Scope, Unsupported
from .ray_nodes import Viewer, layer_weight_mean
from .surface_samples import SurfaceSamples
from .temporary import leave_nothing_behind, new_camera, plain_render_settings, render_pixels

_PREFIX = "gridlight "
_MOST_ROWS = 512  # of places in one render


def render_places(
    material: bpy.types.Material,
    socket: bpy.types.NodeSocket,
    scope: Scope | None,
    samples: SurfaceSamples,
    viewer: Viewer,
) -> np.ndarray:
    """(rows, columns, 3) float32 values of the output ``socket`` at the texels of the atlas of ``samples``, as
    ``viewer`` sees them.

    Raises:
        Unsupported: it depends on something that ``samples`` do not know.
    """
    rows, columns = samples.atlas.shape
    with leave_nothing_behind():
        copy = material.copy()
        tree = copy.node_tree
        show_alone(tree, exposed_in_groups(tree, socket, scope))
        wanted: set[str] = set()
        _replace_places(tree, wanted, viewer)
        arrays = {name: samples.array(name) for name in sorted(wanted)}
        normals = samples.array("object normal") if _projects_boxes(tree) else None
        parts = []
        for start in range(0, rows, _MOST_ROWS):
            count = min(_MOST_ROWS, rows - start)
            part = slice(start * columns, (start + count) * columns)
            mesh = _quads(count, columns, {name: array[part] for name, array in arrays.items()})
            if normals is not None:
                mesh.normals_split_custom_set(np.repeat(normals[part], 4, axis=0).tolist())
            mesh.materials.append(copy)
            parts.append(_render(mesh, count, columns))
        return np.concatenate(parts)


def place_of(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> str | None:
    """The name in ``SurfaceSamples`` of what an output hands out; None where it is no matter of the place.

    Raises:
        Unsupported: it is one, but nobody knows it.
    """
    kind = node.bl_idname
    if kind == "ShaderNodeTexCoord":
        names = {"UV": "uv ", "Generated": "generated", "Object": "object", "Normal": "object normal"}
        if socket.name not in names or (socket.name == "Object" and node.object is not None) or node.from_instancer:
            raise Unsupported(f"{socket.name} coordinates")
        return names[socket.name]
    if kind == "ShaderNodeUVMap":
        return f"uv {node.uv_map}"
    if kind == "ShaderNodeVertexColor":
        return f"{'alpha' if socket.name == 'Alpha' else 'attribute'} {node.layer_name}"
    if kind == "ShaderNodeAttribute":
        if node.attribute_type == "VIEW_LAYER":
            raise Unsupported("attributes of the view layer")
        source = "attribute" if node.attribute_type == "GEOMETRY" else "property"
        return f"{'alpha' if socket.name == 'Alpha' and source == 'attribute' else source} {node.attribute_name}"
    if kind == "ShaderNodeNewGeometry":
        names = {"Position": "position", "Normal": "normal", "True Normal": "normal", "Backfacing": None}
        if socket.name not in names:
            raise Unsupported(f"'{socket.name}' of Geometry")
        return names[socket.name]
    if kind == "ShaderNodeObjectInfo":
        names = {
            "Location": "location",
            "Color": "color",
            "Alpha": "alpha",
            "Object Index": "index",
            "Random": "random",
        }
        return f"info {names[socket.name]}" if socket.name in names else None
    return None


def _default_place(node: bpy.types.Node) -> str | None:
    """What a texture takes where nothing is linked to its Vector."""
    if not node.bl_idname.startswith("ShaderNodeTex") or node.bl_idname in _WITHOUT_PLACE:
        return None
    return "uv " if node.bl_idname == "ShaderNodeTexImage" else "generated"


_WITHOUT_PLACE = {
    "ShaderNodeTexWhiteNoise",
    "ShaderNodeTexEnvironment",
    "ShaderNodeTexSky",
    "ShaderNodeTexIES",
    "ShaderNodeTexPointDensity",
    "ShaderNodeTexCoord",
}


def _replace_places(tree: bpy.types.NodeTree, wanted: set[str], viewer: Viewer) -> None:
    """Feed what depends on the place from attributes; node groups are copied for it. Adds to ``wanted``."""
    made: dict[str, bpy.types.Node] = {}

    def attribute(name: str) -> bpy.types.Node:
        if name not in made:
            made[name] = tree.nodes.new("ShaderNodeAttribute")
            made[name].attribute_name = _PREFIX + name
            wanted.add(name)
        return made[name]

    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            _replace_places(node.node_tree, wanted, viewer)
            continue
        for socket in node.outputs:
            if not socket.is_linked:
                continue
            targets = [link.to_socket for link in socket.links]
            if node.bl_idname in _OF_RAYS or socket.name == "Backfacing":
                _fix(tree, node, socket, targets, viewer)
                continue
            try:
                name = place_of(node, socket)
            except Unsupported:
                _middle(tree, socket, targets)
                continue
            if name is None:
                if node.bl_idname == "ShaderNodeAmbientOcclusion":
                    _open(tree, node, socket, targets)
                continue
            source = attribute(name)
            output = source.outputs["Fac" if socket.type == "VALUE" else "Vector"]
            if socket.type == "RGBA":
                output = source.outputs["Color"]
            _feed(tree, output, targets)
        name = _default_place(node)
        vector = node.inputs.get("Vector") if name else None
        if vector is not None and not vector.is_linked:
            tree.links.new(attribute(name).outputs["Vector"], vector)


_OF_RAYS = {"ShaderNodeLightPath", "ShaderNodeFresnel", "ShaderNodeLayerWeight"}


def _fix(tree, node, socket, targets, viewer: Viewer) -> None:
    """Replace what depends on the ray by what ``viewer`` is told, on the mean."""
    if node.bl_idname == "ShaderNodeLightPath":
        number = viewer.light_path(socket.name)
    elif node.bl_idname == "ShaderNodeNewGeometry":
        number = viewer.backfacing
    elif node.bl_idname == "ShaderNodeFresnel":
        number = fresnel_mean(float(node.inputs["IOR"].default_value))
    else:
        number = layer_weight_mean(float(node.inputs["Blend"].default_value), socket.name)
    _feed(tree, _number(tree, number), targets)


def _middle(tree, socket, targets) -> None:
    """Replace what nobody knows here by the middle of its range."""
    if socket.type == "VALUE":
        _feed(tree, _number(tree, 0.5), targets)


def _open(tree, node, socket, targets) -> None:
    """Ambient occlusion as if nothing were near: light transport knows what is."""
    if socket.name == "Color" and node.inputs["Color"].is_linked:
        output = node.inputs["Color"].links[0].from_socket
    elif socket.name == "Color":
        color = tree.nodes.new("ShaderNodeRGB")
        color.outputs[0].default_value = node.inputs["Color"].default_value
        output = color.outputs[0]
    else:
        output = _number(tree, 1.0)
    _feed(tree, output, targets)


def _number(tree: bpy.types.NodeTree, number: float) -> bpy.types.NodeSocket:
    """The output of a new node that is ``number`` everywhere."""
    output = tree.nodes.new("ShaderNodeValue").outputs[0]
    output.default_value = number
    return output


def _feed(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket, targets) -> None:
    for target in targets:
        tree.links.new(output, target)


def _projects_boxes(tree: bpy.types.NodeTree) -> bool:
    """Whether a texture is laid on by the direction that its surface faces."""
    return any(
        (node.type == "GROUP" and node.node_tree is not None and _projects_boxes(node.node_tree))
        or getattr(node, "projection", "") == "BOX"
        for node in tree.nodes
    )


def _quads(rows: int, columns: int, arrays: dict[str, np.ndarray]) -> bpy.types.Mesh:
    """A grid of quads of edge 1 with ``arrays`` (rows · columns, 1 or 3) as attributes of its faces."""
    mesh = bpy.data.meshes.new("Gridlight Places")
    y, x = np.mgrid[: rows + 1, : columns + 1]
    mesh.vertices.add(x.size)
    mesh.vertices.foreach_set("co", np.stack([x, y, 0 * x], axis=-1).astype(np.float32).ravel())
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    corners = np.stack([corner, corner + 1, corner + columns + 2, corner + columns + 1], axis=1)
    mesh.loops.add(corners.size)
    mesh.loops.foreach_set("vertex_index", corners.ravel().astype(np.int32))
    mesh.polygons.add(len(corners))
    mesh.polygons.foreach_set("loop_start", np.arange(0, corners.size, 4, dtype=np.int32))
    for name, array in arrays.items():
        vector = array.shape[1] == 3
        layer = mesh.attributes.new(_PREFIX + name, "FLOAT_VECTOR" if vector else "FLOAT", "FACE")
        layer.data.foreach_set("vector" if vector else "value", np.ascontiguousarray(array, np.float32).ravel())
    mesh.update()
    return mesh


def _render(mesh: bpy.types.Mesh, rows: int, columns: int) -> np.ndarray:
    """(rows, columns, 3): the quads from above, one a pixel."""
    scene = bpy.data.scenes.new("Gridlight Places")
    scene.collection.objects.link(bpy.data.objects.new("Gridlight Places", mesh))
    scene.camera = new_camera(scene)
    scene.camera.location = (columns / 2, rows / 2, 2)
    scene.camera.data.type = "ORTHO"
    scene.camera.data.ortho_scale = max(rows, columns)  # of the longer side of the picture
    plain_render_settings(scene)
    unbiased_settings(scene, samples=1, bounces=0)
    scene.render.use_persistent_data = False  # Cycles would look for this scene when it is gone
    scene.render.resolution_x, scene.render.resolution_y = columns, rows
    return render_pixels(scene, scene.view_layers[0].name)
