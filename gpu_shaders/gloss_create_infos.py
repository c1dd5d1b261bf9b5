# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of what knows glossy surfaces. Same form as create_infos.py."""

from __future__ import annotations

from ..core.gloss import (
    ATTEMPTS,
    LEAST_LOOKS,
    LIGHT_STREAM,
    LOOKS_IN_ALL,
    MOST_REFLECTIONS,
    PATCH_BLUR,
    REFLECTION_STREAM,
    TEXEL_BLUR,
    TEXEL_LOOKS,
    TEXEL_RAYS,
)
from .create_infos import NO_SURFACE, _emitters, _image, _ints, _light_files, _samplers, _scene, _sheet_files, _sheets

_NUMBERS = {
    "ATTEMPTS": ATTEMPTS,
    "MOST_REFLECTIONS": MOST_REFLECTIONS,
    "REFLECTION_STREAM": f"{REFLECTION_STREAM}u",
    "LIGHT_STREAM": f"{LIGHT_STREAM}u",
    "PATCH_BLUR": PATCH_BLUR,
    "TEXEL_BLUR": TEXEL_BLUR,
}


def gloss(info, defines: dict, first: int) -> int:
    """What is glossy, where the scene has such surfaces."""
    if "HAS_GLOSS" not in defines:
        return first
    for name, value in _NUMBERS.items():
        info.define(name, str(value))
    return _samplers(info, "gloss_rows", first=first)


def gloss_files(defines: dict, rays: bool = True) -> list[str]:
    """What follows mirrored ``rays``, to come after what lights points."""
    return ["gloss_lib", *(["gloss_light_lib", "reflection_lib"] if rays else [])] if "HAS_GLOSS" in defines else []


def texel_reflections_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    info.define("REFLECTIONS", str(TEXEL_RAYS))
    for name, value in (("LOOKS", TEXEL_LOOKS), ("LEAST_LOOKS", LEAST_LOOKS), ("LOOKS_IN_ALL", LOOKS_IN_ALL)):
        info.define(name, str(value))
    slot = gloss(info, defines, _emitters(info, defines, _scene(info, defines)))
    slot = _samplers(info, "lights", "probe_slots", "world_texels", first=slot)
    slot = _sheets(info, defines, slot)
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=slot)
    for number, name in enumerate(("hits", "reflected", "carried")):
        _image(info, number, name)
    _image(info, 3, "albedo", layered=True, access="READ+WRITE")
    if "HAS_SHEETS" in defines:
        _image(info, 4, "hit_sheets", pixel="R32F")
    _ints(info, "first_slot", "first_layer", "first_probe", "light_count", "seed")
    info.local_group_size(8, 8, 1)
    files = [*_light_files(defines | {"HAS_ALPHA": True}), *gloss_files(defines), *_sheet_files(defines)]
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", *files, "texel_reflections_comp"]}


def texel_mirrored_comp(info, defines):
    _samplers(info, "ends", "reflected", "carried")
    _image(info, 0, "mirrored")
    _image(info, 1, "seen", pixel="R32F")
    _ints(info, "first_texel", "texel_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "texel_mirrored_comp"]}
