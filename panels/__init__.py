# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sees: the sidebar's tab "Gridlight", in the order of work, and entries in the Add menu.

Panels only draw. What changes data is an operator's work.
"""

_unregister: list = []


def register():
    import bpy

    from . import bake, export, lights, menus, preview, report, volume

    classes = [item for module in (volume, bake, lights, preview, export, report) for item in module.classes]
    enter, leave = bpy.utils.register_classes_factory(classes)
    enter()
    _unregister.append(leave)
    menus.attach()
    _unregister.append(menus.detach)


def unregister():
    while _unregister:
        _unregister.pop()()
