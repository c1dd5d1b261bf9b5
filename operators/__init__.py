# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user can do: one subject per module, registered here in order and unregistered in reverse."""

_unregister: list = []


def _modules() -> tuple:
    """Modules with operators, in the order of registration. Imported here: the package must load without Blender."""
    from . import bake, explore, export, gallery, import_field, place_probes, preview, report, stale, volume

    return volume, place_probes, bake, stale, gallery, preview, explore, export, import_field, report


def register():
    import bpy

    from . import bake, explore, kept_bakes, preview, properties, stale

    modules = _modules()
    classes = [item for module in modules for item in module.classes]
    enter, leave = bpy.utils.register_classes_factory((*properties.classes, *classes))
    enter()
    _unregister.append(leave)
    properties.attach()
    _unregister.append(properties.detach)
    kept_bakes.attach()
    _unregister.append(kept_bakes.detach)
    stale.attach()
    _unregister.append(stale.detach)
    preview.attach()
    _unregister.append(preview.detach)
    _unregister.append(explore.stop_running)
    _unregister.append(lambda: bake.stop_running("The bake was given up, because Gridlight was switched off"))


def unregister():
    while _unregister:
        _unregister.pop()()
