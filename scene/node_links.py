# SPDX-License-Identifier: GPL-3.0-or-later
"""Following links through a shader tree: reroutes, muted nodes and node groups are transparent."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Scope:
    """The group node through which the current tree was entered, and the scope around that one."""

    node: bpy.types.Node
    parent: Scope | None


class Unsupported(Exception):
    """A node or wiring that cannot be evaluated; the message is a short reason."""


class Reported(Unsupported):
    """One that the user has been told of already."""


def find_socket(sockets, identifier: str):
    """The enabled socket with this identifier or name, or None."""
    named = sockets.get(identifier)
    if named is not None and named.identifier == identifier:  # most are, and Blender finds names faster
        return named
    for socket in sockets:
        if socket.identifier == identifier:
            return socket
    return named


def resolve(socket: bpy.types.NodeSocket, scope: Scope | None):
    """What really feeds the input ``socket``: ``(socket, scope)``.

    The result is the output socket of a node that computes something, or an input socket without a link whose own value
    counts.
    """
    for _ in range(10_000):  # a tree cannot be deeper; a broken file could hold a loop
        if not socket.is_linked:  # asking for its links looks at all of the tree's
            return socket, scope
        link = next((link for link in socket.links if not link.is_muted and link.is_valid), None)
        if link is None:
            return socket, scope
        node, output = link.from_node, link.from_socket
        inner = _pass_through(node, output, scope)
        if inner is None:
            return output, scope
        socket, scope = inner
    raise Unsupported("its links form a loop")


def _pass_through(node, output, scope):
    """The input that ``output`` of ``node`` merely hands on, or None where the node computes something itself."""
    if node.type == "REROUTE":
        return node.inputs[0], scope
    if node.mute:
        for link in node.internal_links:
            if link.to_socket == output:
                return link.from_socket, scope
        return None
    if node.type == "GROUP" and node.node_tree is not None:
        exits = [item for item in node.node_tree.nodes if item.type == "GROUP_OUTPUT"]
        exit_node = next((item for item in exits if item.is_active_output), None)
        inner = find_socket(exit_node.inputs, output.identifier) if exit_node else None
        return (inner, Scope(node, scope)) if inner else None
    if node.type == "GROUP_INPUT" and scope is not None:
        outer = find_socket(scope.node.inputs, output.identifier)
        return (outer, scope.parent) if outer else None
    return None


def active_output(tree: bpy.types.NodeTree, kind: str) -> bpy.types.Node | None:
    """The output node that Cycles renders: the active one for Cycles, else the active one for all engines.

    ``kind`` is a node's ``bl_idname`` such as ``ShaderNodeOutputMaterial``.
    """
    outputs = [node for node in tree.nodes if node.bl_idname == kind and not node.mute]
    for target in ("CYCLES", "ALL"):
        for node in sorted(outputs, key=lambda item: not item.is_active_output):
            if node.target == target:
                return node
    return None
