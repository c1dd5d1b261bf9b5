# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that carry light between patches: patch_light.py. Same form as create_infos.py."""

from __future__ import annotations

from ..core.patches import MOST_CAUGHT, NO_PATCH, NOTHING
from ..core.reference_scene import COUPLING_SEARCH
from .create_infos import (
    RAY_FILES,
    _coupling_files,
    _couplings,
    _emitters,
    _image,
    _ints,
    _light_files,
    _samplers,
    _scene,
    _sheet_files,
    _sheets,
)
from .gloss_create_infos import gloss, path_files


def patch_rays_comp(info, defines):
    lights_points = int(defines["SEGMENTS"]) > 1 or "HAS_GLOSS" in defines
    slot = _scene(info, defines)
    if lights_points:
        slot = _emitters(info, defines, slot)
        _ints(info, "light_count")
        slot = _samplers(info, "lights", first=slot)
    slot = _samplers(info, "patch_points", "world_texels", first=slot)
    slot = _couplings(info, defines, _sheets(info, defines, slot, "sheet_numbers"))
    gloss(info, defines, slot)
    _image(info, 0, "hits")
    _image(info, 1, "carried")
    _image(info, 2, "reflected")
    if "HAS_SHEETS" in defines:
        _image(info, 3, "hit_sheets", pixel="R32F")
    _ints(info, "first_ray", "ray_count", "rays_each", "first_key", "seed")
    info.local_group_size(64, 1, 1)
    return {
        "compute": [
            "data_lib",
            "octahedral_lib",
            "cubemap_lib",
            *_coupling_files(defines),
            *(
                _light_files(defines | {"HAS_ALPHA": True})
                if lights_points
                else ("random_lib", "surface_lib", *RAY_FILES)
            ),
            *path_files(defines),
            *_sheet_files(defines),
            "patch_rays_comp",
        ]
    }


def place_coupling_comp(info, defines):
    info.define("SEARCH", repr(COUPLING_SEARCH))
    _samplers(info, "patch_points", first=_scene(info, defines))
    _image(info, 0, "couplings")
    _ints(info, "first_place", "place_count")
    info.local_group_size(64, 1, 1)
    files = ["surface_lib", "offset_lib", "ray_lib", "place_coupling_comp"]
    return {"compute": ["data_lib", "octahedral_lib", *files]}


def patch_carried_comp(info, defines):
    _samplers(info, "carried")
    _image(info, 0, "brought")
    _ints(info, "first_patch", "patch_count", "rays_each")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_carried_comp"]}


def patch_caught_comp(info, defines):
    for name, value in (("MOST_CAUGHT", MOST_CAUGHT), ("NO_PATCH", NO_PATCH), ("NOTHING", NOTHING)):
        info.define(name, str(value))
    _image(info, 0, "ray_ends", pixel="R32F", access="READ+WRITE")
    _ints(info, "patch_count", "rays_each")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_caught_comp"]}


def patch_iterate_comp(info, defines):
    _samplers(info, "direct", "brought", "reflected", "ray_ends", "irradiance_in")
    _image(info, 0, "irradiance_out")
    _ints(info, "patch_count", "rays_each", "bounce")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_iterate_comp"]}
