# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that only a relight needs. Same form as create_infos.py."""

from __future__ import annotations

from .create_infos import _image, _ints, _samplers


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
