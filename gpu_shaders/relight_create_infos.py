# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that only a relight needs. Same form as create_infos.py."""

from __future__ import annotations

from .create_infos import NO_SURFACE, RAY_FILES, _image, _ints, _samplers, _scene
from .gloss_create_infos import gloss


def probe_reach_comp(info, defines):
    slot = _samplers(info, "probe_slots", "change_boxes")
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "reached", pixel="R32F")
    _ints(info, "first_slot", "box_count", "old_count")
    info.local_group_size(int(defines["GROUP"]), 1, 1)
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", "box_clip_lib", "probe_reach_comp"]}


def scatter_comp(info, defines):
    _samplers(info, "places", "values")
    _image(info, 0, "target")
    _ints(info, "value_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "scatter_comp"]}


def surface_again_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _scene(info, defines)
    names = ["new_numbers"] if "RENUMBER" in defines else []
    gloss(info, defines, _samplers(info, "probe_slots", "world_texels", *names, first=slot))
    _image(info, 0, "geometry", layered=True, access="READ+WRITE")
    _image(info, 1, "albedo", layered=True, access="READ+WRITE")
    _image(info, 2, "emission", layered=True)
    _image(info, 3, "rebind", pixel="R32F")
    _ints(info, "first_slot")
    info.local_group_size(8, 8, 1)
    gloss_lib = ["random_lib", "gloss_lib"] if "HAS_GLOSS" in defines else []
    files = ["surface_lib", *RAY_FILES, *gloss_lib, "surface_again_comp"]
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", *files]}


def layers_move_comp(info, defines):
    slot = _samplers(info, "from_layer")
    _samplers(info, "old_geometry", "old_albedo", "old_emission", kind="FLOAT_2D_ARRAY", first=slot)
    for number, name in enumerate(("geometry", "albedo", "emission")):
        _image(info, number, name, layered=True)
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "layers_move_comp"]}
