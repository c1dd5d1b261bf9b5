# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: one subject per module, registered here in order and unregistered in reverse."""

_unregister = []


def _classes() -> tuple:
    """Every operator, in the order of registration. Imported here, because the package must load without Blender."""
    from . import place_probes

    return place_probes.classes


def register():
    import bpy

    from . import properties

    enter, leave = bpy.utils.register_classes_factory((*properties.classes, *_classes()))
    enter()
    _unregister.append(leave)
    properties.attach()
    _unregister.append(properties.detach)


def unregister():
    while _unregister:
        _unregister.pop()()
