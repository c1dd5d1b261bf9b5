# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: one operator per module, registered here in order and unregistered in reverse."""

_unregister = []


def _classes():
    return ()


def register():
    import bpy

    enter, leave = bpy.utils.register_classes_factory(_classes())
    enter()
    _unregister.append(leave)


def unregister():
    while _unregister:
        _unregister.pop()()
