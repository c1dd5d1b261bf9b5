# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets a camera see what a probe lights surfaces with: what materials and worlds show to diffuse rays, whatever their
Light Path nodes keep for cameras."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

import bpy

from .ray_nodes import DIFFUSE_RAY

_TOLD = {"Is Camera Ray", *DIFFUSE_RAY} - {"Ray Length"}


@contextmanager
def as_to_diffuse_rays() -> Iterator[None]:
    """Light Path nodes tell camera rays what they tell diffuse ones. They are the user's own, and restored."""
    changed: list[tuple] = []
    try:
        for tree in _trees():
            _answer(tree, changed)
        yield
    finally:
        for tree, output, targets, added in changed:
            for target in targets:
                tree.links.new(output, target)
            tree.nodes.remove(added)


def _trees() -> list[bpy.types.NodeTree]:
    owners: Iterable = (*bpy.data.materials, *bpy.data.worlds)
    groups = [group for group in bpy.data.node_groups if group.bl_idname == "ShaderNodeTree"]
    return [owner.node_tree for owner in owners if owner.node_tree is not None] + groups


def _answer(tree: bpy.types.NodeTree, changed: list[tuple]) -> None:
    """Put a node between each answer and who gets it; ``changed`` takes how to undo that."""
    for node in [node for node in tree.nodes if node.bl_idname == "ShaderNodeLightPath" and not node.mute]:
        for output in node.outputs:
            targets = [link.to_socket for link in output.links if not link.is_muted]
            if not targets or output.name not in _TOLD:
                continue
            if output.name == "Is Camera Ray":
                added = tree.nodes.new("ShaderNodeValue")
                added.outputs[0].default_value = 0.0
            else:
                added = tree.nodes.new("ShaderNodeMath")
                added.operation = "MAXIMUM"
                tree.links.new(output, added.inputs[0])
                tree.links.new(node.outputs["Is Camera Ray"], added.inputs[1])
            changed.append((tree, output, targets, added))
            for target in targets:
                tree.links.new(added.outputs[0], target)
