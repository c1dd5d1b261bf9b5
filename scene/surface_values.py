# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates materials whose pattern no UV map can carry: vertex colours, object and generated coordinates, positions,
procedural textures in space, textures with different mappings.

Their values are found at every texel of an atlas of all the surface that shows the material (``surface_atlas``), by
Cycles itself (``placed_render``).
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from .node_links import Reported, Scope, Unsupported, resolve
from .placed_render import place_of, render_places
from .ray_nodes import Viewer
from .shader_nodes import NodeEvaluator
from .shader_values import Domain, Value
from .surface_samples import SurfaceSamples

ATLAS_MAP = "\0atlas"  # no UV map can be called so
ATLAS = Domain(ATLAS_MAP, extension="ATLAS")


class SurfaceEvaluator(NodeEvaluator):
    """A NodeEvaluator whose values lie on the atlas of ``samples`` wherever they depend on the place."""

    def __init__(
        self,
        owner,
        images,
        notices,
        owner_name,
        material: bpy.types.Material,
        samples: SurfaceSamples,
        viewer: Viewer = Viewer(),
    ):
        super().__init__(owner, images, notices, owner_name, viewer=viewer)
        self._material, self._samples = material, samples

    def output(self, socket: bpy.types.NodeSocket, scope: Scope | None) -> Value:
        key = (socket.as_pointer(), scope)
        if key not in self._values:
            unknown: set[str] = set()
            if self._depends_on_place(socket, scope, unknown, set()):
                for reason in sorted(unknown):
                    self.notices.append(f"{self.owner}: {reason} have no counterpart here; a middle value is used")
                pixels = self._given(socket)
                if pixels is None:
                    pixels = render_places(self._material, socket, scope, self._samples, self.viewer)
                    if socket.type == "VALUE":
                        pixels = np.ascontiguousarray(pixels[..., :1])
                for name in sorted(self._samples.missing):
                    self.notices.append(
                        f"{self.owner}: some of its meshes have no attribute '{name}': black, as in Cycles"
                    )
                self._values[key] = Value(np.ones(1, np.float32), pixels, ATLAS)
        return super().output(socket, scope)

    def _depends_on_place(self, socket, scope, unknown: set[str], seen: set) -> bool:
        """Whether the output ``socket`` differs over a surface. Adds to ``unknown`` what nobody can tell.

        Raises:
            Unsupported: an image is missing, which Cycles would show in pink.
        """
        node = socket.node
        depends = False
        try:
            depends = place_of(node, socket) is not None
        except Unsupported as reason:
            depends = True
            unknown.add(str(reason))
        depends |= node.bl_idname.startswith("ShaderNodeTex") and node.bl_idname != "ShaderNodeTexCoord"
        if (node, scope) in seen:
            return depends
        seen.add((node, scope))
        if node.bl_idname == "ShaderNodeTexImage":
            if node.image is None:
                raise Unsupported("no image is chosen")
            if self.images.pixels(node.image, self.owner) is None:
                raise Reported("its image is missing")
        for item in node.inputs:
            if item.enabled:
                source, source_scope = resolve(item, scope)
                if source.is_output:
                    depends |= self._depends_on_place(source, source_scope, unknown, seen)
        return depends

    def _given(self, socket: bpy.types.NodeSocket) -> np.ndarray | None:
        """(rows, columns, 1 or 3) of an output that hands out what the samples hold; None for all others."""
        try:
            name = place_of(socket.node, socket)
        except Unsupported:
            return None
        if name is None:
            return None
        values = self._samples.array(name)
        if socket.type == "VALUE":
            values = values.mean(axis=1, keepdims=True)
        return values.reshape(*self._samples.atlas.shape, -1)


@dataclass(frozen=True)
class Wants:
    """What a material asks of the meshes and objects that show it."""

    attributes: frozenset[str] = frozenset()  # "" is the colour that renders show
    properties: frozenset[str] = frozenset()  # custom ones of the object
    instance: bool = False  # every instance of a mesh looks different


def wants(material: bpy.types.Material | None) -> Wants:
    """What ``material`` might ask for, by the nodes that are linked to something."""
    attributes, properties, instance = set(), set(), False
    trees = [material.node_tree] if material is not None and material.node_tree is not None else []
    seen = set()
    while trees:
        tree = trees.pop()
        if tree in seen:
            continue
        seen.add(tree)
        for node in tree.nodes:
            if node.type == "GROUP" and node.node_tree is not None:
                trees.append(node.node_tree)
            for socket in node.outputs:
                if not socket.is_linked:
                    continue
                try:
                    kind, _, name = (place_of(node, socket) or "").partition(" ")
                except Unsupported:
                    continue
                if kind in ("attribute", "alpha"):
                    attributes.add(name)
                if kind == "property":
                    properties.add(name)
                instance |= kind in ("position", "normal", "info", "property")
    return Wants(frozenset(attributes), frozenset(properties), instance)
