# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of other files: linked ones, and library overrides of them.

Blender saves neither the custom properties of linked objects nor those of overrides that the library does not expect,
so light and settings that are put there look right until the file is loaded again.
"""

from __future__ import annotations

import bpy


def library_of(item: bpy.types.Object) -> str:
    """Name of the file that ``item`` comes from, linked or overridden; empty where it is this file's own."""
    override = item.override_library
    library = override.reference.library if override is not None else item.library
    return bpy.path.basename(library.filepath) if library is not None else ""


def cannot_keep(volume: bpy.types.Object) -> str:
    """In one line why this file cannot keep light for ``volume``, and the remedy; empty where it can."""
    library = library_of(volume)
    if not library:
        return ""
    return (
        f"'{volume.name}' comes from {library}, and what is changed here would not be saved: "
        "bake it in that file, or add a volume of your own here"
    )
