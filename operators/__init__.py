# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: one subject per module, registered here in order and unregistered in reverse."""

_unregister = []


def _classes() -> tuple:
    """Every operator, in the order of registration. Imported here, because the package must load without Blender."""
    from .place_probes import GRIDLIGHT_OT_clear_probes, GRIDLIGHT_OT_place_probes

    return GRIDLIGHT_OT_place_probes, GRIDLIGHT_OT_clear_probes


def register():
    import bpy

    enter, leave = bpy.utils.register_classes_factory(_classes())
    enter()
    _unregister.append(leave)


def unregister():
    while _unregister:
        _unregister.pop()()
