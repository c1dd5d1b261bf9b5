# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that keep shown light up to date. Same form as create_infos.py."""

from __future__ import annotations

from ..core.gradients import MOST_CHANGE, STEEPEST
from .create_infos import _image, _ints, _samplers


def live_field_comp(info, defines):
    info.define("MOST_CHANGE", repr(MOST_CHANGE))
    _samplers(info, "probe_slots", "target_field", "target_gradient", "steepness")
    _image(info, 0, "field", access="READ+WRITE")
    _image(info, 1, "gradient", access="READ+WRITE")
    info.uniform_buf(0, "vec4", "cell_info[3]")
    _ints(info, "slot_count")
    info.push_constant("FLOAT", "share")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "live_gradient_lib", "live_field_comp"]}


def live_steepness_comp(info, defines):
    info.define("STEEPEST", repr(STEEPEST))
    _samplers(info, "slot_neighbours", "target_field", "target_gradient")
    _image(info, 0, "steepness")
    info.uniform_buf(0, "vec4", "cell_info[3]")
    _ints(info, "slot_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "live_gradient_lib", "live_steepness_comp"]}


def live_fill_comp(info, defines):
    _samplers(info, "fill_nodes")
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "node_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "live_fill_comp"]}
