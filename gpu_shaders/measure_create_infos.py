# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that measure what a device can do at most, as create_infos.py describes them."""

from __future__ import annotations


def measure_copy_comp(info, _defines):
    info.sampler(0, "FLOAT_2D", "from_texels")
    info.image(0, "RGBA32F", "FLOAT_2D", "to_texels", qualifiers={"WRITE"})
    info.local_group_size(16, 16, 1)
    return {"compute": ["measure_copy_comp"]}


def measure_arithmetic_comp(info, _defines):
    info.image(0, "RGBA32F", "FLOAT_2D", "to_texels", qualifiers={"WRITE"})
    info.push_constant("INT", "rounds")
    info.push_constant("FLOAT", "factor")
    info.local_group_size(16, 16, 1)
    return {"compute": ["measure_arithmetic_comp"]}
