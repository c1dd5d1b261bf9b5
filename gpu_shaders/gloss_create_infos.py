# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of what knows glossy surfaces. Same form as create_infos.py."""

from __future__ import annotations

from ..core.gloss import (
    ATTEMPTS,
    DIELECTRIC,
    LEAST_LOOKS,
    LIGHT_STREAM,
    LOOKS_A_RAY,
    LOOKS_IN_ALL,
    MOST_REFLECTIONS,
    PATCH_BLUR,
    REFLECTION_STREAM,
    TEXEL_BLUR,
    TEXEL_LOOKS,
    TEXEL_RAYS,
)
from ..core.highlights import (
    EMITTER_LOOKS,
    HIGHLIGHT_BLUR,
    HIGHLIGHT_STREAM,
    LAMP_LOOKS,
    LEAST_SEEN,
    MOST_LOOKS,
    NEAR_PEAK,
    SHARP,
)
from ..core.patches import POINTS
from .create_infos import (
    _PROBE_FILES,
    NO_SURFACE,
    _emitters,
    _group_sums,
    _image,
    _ints,
    _light_files,
    _samplers,
    _scene,
    _sheet_files,
    _sheets,
)
from .patch_create_infos import _compaction

_NUMBERS = {
    "ATTEMPTS": ATTEMPTS,
    "DIELECTRIC": DIELECTRIC,
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


def path_files(defines: dict) -> list[str]:
    """What follows rays from surface to surface, mirrored ones among them, to come after what lights points."""
    gloss = ["gloss_lib", "gloss_light_lib", "reflection_lib"] if "HAS_GLOSS" in defines else []
    return ["way_lib", "path_lib", *gloss]


def _glossy_texels(info, *names: str) -> None:
    """What glossy_texels_lib reads, and samplers ``names``."""
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _samplers(info, "triangle_attributes", "gloss_rows", *names)
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=slot)
    _ints(info, "first_layer", "texel_count")


def glossy_count_comp(info, defines):
    _glossy_texels(info)
    _image(info, 0, "block_counts", pixel="R32F")
    return _compaction(info, "glossy_texels_lib", "compaction_lib", "compact_count_comp", places=False)


def glossy_list_comp(info, defines):
    _glossy_texels(info, "block_counts")
    _image(info, 0, "total_out", pixel="R32F")
    _image(info, 1, "listed", pixel="R32F")
    return _compaction(info, "glossy_texels_lib", "compaction_lib", "compact_list_comp")


def _glossy_entries(info, defines: dict, *names: str) -> None:
    """What shaders read that ask what glossy texels mirror, and samplers ``names``."""
    info.define("REFLECTIONS", str(TEXEL_RAYS))
    slot = gloss(info, defines, _emitters(info, defines, _scene(info, defines)))
    slot = _samplers(info, "lights", "probe_slots", "glossy", *names, first=slot)
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=_sheets(info, defines, slot))
    _ints(info, "first_slot", "first_layer", "first", "count", "light_count", "seed")
    info.local_group_size(64, 1, 1)


def _glossy_entry_files(defines: dict, *files: str) -> dict:
    *libraries, own = files
    libraries = [*_light_files(defines | {"HAS_ALPHA": True}), *libraries, *_sheet_files(defines)]
    entries = ["texel_ways_lib", "glossy_entry_lib"]
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", *libraries, *entries, own]}


def texel_lamps_comp(info, defines):
    for name, value in (
        ("LOOKS", TEXEL_LOOKS),
        ("LEAST_LOOKS", LEAST_LOOKS),
        ("LOOKS_IN_ALL", LOOKS_IN_ALL),
        ("LOOKS_A_RAY", LOOKS_A_RAY),
    ):
        info.define(name, str(value))
    _glossy_entries(info, defines)
    _image(info, 0, "carried")
    return _glossy_entry_files(defines, "way_lib", "gloss_lib", "gloss_light_lib", "texel_lamps_comp")


def texel_reflections_comp(info, defines):
    _glossy_entries(info, defines, "world_texels")
    _image(info, 0, "carried", access="READ+WRITE")
    _image(info, 1, "hits")
    _image(info, 2, "reflected")
    _image(info, 3, "albedo", layered=True, access="READ+WRITE")
    _image(info, 4, "entries", pixel="R32F")
    if "HAS_SHEETS" in defines:
        _image(info, 5, "hit_sheets", pixel="R32F")
    return _glossy_entry_files(defines, *path_files(defines), "texel_reflections_comp")


def texel_mirrored_comp(info, defines):
    _samplers(info, "entries", "ends", "reflected", "carried")
    _image(info, 0, "mirrored")
    _image(info, 1, "seen", pixel="R32F")
    _ints(info, "first_texel", "texel_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "texel_mirrored_comp"]}


def highlight_numbers(info, defines: dict) -> None:
    """Numbers of gloss_lib and highlight_lib, beside those of ``gloss``."""
    for name, value in _NUMBERS.items():
        if "HAS_GLOSS" not in defines:
            info.define(name, str(value))
    info.define("HIGHLIGHT_BLUR", str(HIGHLIGHT_BLUR))
    info.define("HIGHLIGHT_STREAM", f"{HIGHLIGHT_STREAM}u")


def _highlights(info, defines: dict) -> int:
    """What highlight_lib reads, the irradiance of the part of the light that is meant among it."""
    highlight_numbers(info, {})
    for name, value in ("LEAST_SEEN", LEAST_SEEN), ("SHARP", SHARP), ("NEAR_PEAK", NEAR_PEAK):
        info.define(name, str(value))
    _ints(info, *(() if "HAS_EMITTERS" in defines else ("first_light", "last_light")), "light_count", "seed")
    slot = _emitters(info, defines, _scene(info, defines))
    return _samplers(info, "lights", "part_irradiance", "part_spread", first=slot)


def _highlight_files(defines: dict) -> list[str]:
    return ["coupling_lib", *_light_files(defines | {"HAS_ALPHA": True}), "gloss_lib", *_sheet_files(defines)]


def highlight_project_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    info.define("LOOKS", str(EMITTER_LOOKS if "HAS_EMITTERS" in defines else LAMP_LOOKS))
    info.define("MOST_LOOKS", str(MOST_LOOKS))
    slot = _samplers(info, "probe_slots", "probe_layers", "texel_weights", first=_highlights(info, defines))
    _samplers(info, "geometry", "albedo", kind="FLOAT_2D_ARRAY", first=_sheets(info, defines, slot))
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "first_slot")
    _group_sums(info, defines)
    own = ["way_lib", "texel_ways_lib", "highlight_lib", "highlight_looks_lib", "highlight_project_comp"]
    return {"compute": [*_PROBE_FILES, "texel_sum_lib", *_highlight_files(defines), *own]}


def patch_highlights_comp(info, defines):
    info.define("PATCH_POINTS", str(POINTS))
    names = "couplings", "patch_points", "leaving_points", "reflected", "ray_ends"
    slot = _samplers(info, *names, first=_highlights(info, defines))
    _sheets(info, defines, slot, "sheet_numbers", "leaving_sheets")
    _image(info, 0, "highlights", access="READ+WRITE")
    _ints(info, "first_key", "count", "rays_each")
    info.local_group_size(64, 1, 1)
    files = [*_highlight_files(defines), "highlight_lib", "highlight_looks_lib", "patch_highlights_comp"]
    return {"compute": ["data_lib", "octahedral_lib", *files]}
