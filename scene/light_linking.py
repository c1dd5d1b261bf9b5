# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking of Blender's objects to ``core.light_links``.

A lamp or glowing object names a collection of receivers and one of blockers. Members are included or excluded, objects
in collections inside it as those collections are. Where any member is included, only included objects count;
else all but the excluded ones. An instance goes by the object that makes it, where any collection names that one.
"""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ..core.light_links import UNLINKED, Links

_RECEIVERS, _BLOCKERS = "receiver_collection", "blocker_collection"


class LightLinking:
    """Groups of the emitters among ``objects``: those with the same collections, in the order in which they come."""

    def __init__(self, objects: Iterable[bpy.types.Object]):
        self._groups: dict[tuple, int] = {}
        self._members: dict[str, list[dict[int, bool] | None]] = {_RECEIVERS: [], _BLOCKERS: []}
        for item in objects:
            key = _collections(item)
            if any(key) and key not in self._groups:
                self._groups[key] = len(self._groups) + 1
                for kind, members in self._members.items():
                    members.append(_members(getattr(item.original.light_linking, kind)))

    def group(self, item: bpy.types.Object) -> int:
        """To which the light of ``item`` belongs; 0 where it is not linked."""
        return self._groups.get(_collections(item), 0) if self._groups else 0

    def links(self, item: bpy.types.Object, instancer: bpy.types.Object | None) -> Links:
        """What ``item``, as ``instancer`` shows it or by itself, has to do with all groups."""
        if not self._groups:
            return UNLINKED
        return Links(
            self.group(item),
            self._mask(_RECEIVERS, item, instancer),
            self._mask(_BLOCKERS, item, instancer),
        )

    def _mask(self, kind: str, item: bpy.types.Object, instancer: bpy.types.Object | None) -> int:
        """The groups whose receivers or blockers it is not."""
        members = [one for one in self._members[kind] if one is not None]
        user = item.original.session_uid
        if instancer is not None and any(instancer.original.session_uid in one for one in members):
            user = instancer.original.session_uid
        mask = 0
        for number, states in enumerate(self._members[kind]):
            if states is not None and not states.get(user, True not in states.values()):
                mask |= 1 << number
        return mask


def _collections(item: bpy.types.Object) -> tuple[int, int]:
    """``session_uid`` of its collections of receivers and of blockers, 0 for none."""
    linking = item.original.light_linking
    receivers, blockers = linking.receiver_collection, linking.blocker_collection
    return receivers.session_uid if receivers else 0, blockers.session_uid if blockers else 0


def _members(collection: bpy.types.Collection | None) -> dict[int, bool] | None:
    """Objects of ``collection`` by ``session_uid``, True for those that are included; None without a collection."""
    if collection is None:
        return None
    members: dict[int, bool] = {}
    for child, link in zip(collection.children, collection.collection_children):
        included = link.light_linking.link_state == "INCLUDE"
        members.update((item.session_uid, included) for item in child.all_objects)
    for item, link in zip(collection.objects, collection.collection_objects):
        members[item.session_uid] = link.light_linking.link_state == "INCLUDE"
    return members
