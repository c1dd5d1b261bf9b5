# SPDX-License-Identifier: GPL-3.0-or-later
"""Entries in Blender's Add and Import menus."""

from __future__ import annotations

import bpy

from ..operators import names


def _add(self, _context) -> None:
    self.layout.separator()
    self.layout.operator(names.ADD_GALLERY, icon="HOME")


def _add_light_probe(self, _context) -> None:
    self.layout.separator()
    self.layout.operator(names.ADD_VOLUME, icon="LIGHTPROBE_VOLUME")


def _import(self, _context) -> None:
    self.layout.operator(names.IMPORT, text="Gridlight Probes (.exr)")


def attach() -> None:
    bpy.types.VIEW3D_MT_add.append(_add)
    bpy.types.VIEW3D_MT_lightprobe_add.append(_add_light_probe)
    bpy.types.TOPBAR_MT_file_import.append(_import)


def detach() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_import)
    bpy.types.VIEW3D_MT_lightprobe_add.remove(_add_light_probe)
    bpy.types.VIEW3D_MT_add.remove(_add)
