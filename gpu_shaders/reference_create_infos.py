# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shader that checks a bake by paths. Same form as create_infos.py."""

from __future__ import annotations

from .create_infos import (
    _coupling_files,
    _emitters,
    _image,
    _ints,
    _light_files,
    _samplers,
    _scene,
    _sheet_files,
    _sheets,
)
from .gloss_create_infos import gloss, highlight_numbers, path_files


def probe_paths_comp(info, defines):
    slot = _scene(info, defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "probe_points", "world_texels", first=slot)
    slot = _sheets(info, defines, slot)
    gloss(info, defines, slot)
    highlights = []
    if "HAS_COUPLING" in defines:
        highlight_numbers(info, defines)
        highlights = ["highlight_lib"] if "HAS_GLOSS" in defines else ["gloss_lib", "highlight_lib"]
    _image(info, 0, "directions")
    _image(info, 1, "flux_out")
    _ints(
        info, "path_count", "probe_count", "paths_each", "first_number", "light_count", "first_sun", "bounces", "seed"
    )
    info.local_group_size(64, 1, 1)
    files = [*_light_files(defines | {"HAS_ALPHA": True}), *path_files(defines), *_sheet_files(defines)]
    return {
        "compute": [
            "data_lib",
            "octahedral_lib",
            "cubemap_lib",
            *_coupling_files(defines),
            *files,
            *highlights,
            "probe_paths_comp",
        ]
    }
