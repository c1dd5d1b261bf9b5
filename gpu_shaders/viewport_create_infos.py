# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that make pictures: the viewport's draws and preview_comp. Same form as create_infos.py."""

from __future__ import annotations

from .create_infos import RAY_FILES, _image, _ints, _lookup, _samplers, _scene, _sheet_files, _sheets

_VIEW = "view_info[9]"
_SHADE = "shade_info[2]"


def _shading(info, defines: dict, first: int) -> int:
    """What viewport_shade_lib declares: lamps, the field where there is one, and what to show of them."""
    _ints(info, "light_count", "sample_index")
    slot = _samplers(info, "lights", first=first)
    return _field(info, defines, _sheets(info, defines, slot))


def _field(info, defines: dict, first: int) -> int:
    """What viewport_data_lib declares."""
    info.uniform_buf(2, "vec4", _SHADE)
    if "HAS_FIELD" not in defines:
        return first
    slot = _lookup(info, first)
    return _samplers(info, "field_in", "gradient_in", "node_marks", first=slot)


def _field_files(defines: dict) -> list[str]:
    lookup = ["lookup_lib", "field_lib"] if "HAS_FIELD" in defines else []
    return ["data_lib", "octahedral_lib", "cubemap_lib", "spherical_harmonics_lib", *lookup, "viewport_data_lib"]


def _shading_files(defines: dict) -> list[str]:
    return [
        *_field_files(defines),
        "random_lib",
        "surface_lib",
        *RAY_FILES,
        "direct_light_lib",
        *_sheet_files(defines),
        "viewport_shade_lib",
    ]


def preview_comp(info, defines):
    slot = _scene(info, defines)
    slot = _shading(info, defines, slot)
    _samplers(info, "world_texels", "spheres", first=slot)
    _image(info, 0, "picture", access="READ+WRITE")
    _image(info, 1, "probe_picture", access="READ+WRITE")
    _image(info, 2, "chosen", pixel="R32F", access="READ")
    info.uniform_buf(1, "vec4", _VIEW)
    _ints(info, "chosen_count")
    info.push_constant("FLOAT", "sphere_radius")
    info.local_group_size(64, 1, 1)
    return {"compute": [*_shading_files(defines), "preview_comp"]}


def viewport_surface(info, defines):
    from gpu.types import GPUStageInterfaceInfo

    slot = _scene(info, defines)
    slot = _shading(info, defines, slot)
    _samplers(info, "object_flags", first=slot)
    info.uniform_buf(1, "vec4", _VIEW)
    _ints(info, "triangle_count", "depth_only")
    if "VOLUMES" in defines:
        info.uniform_buf(3, "vec4", f"volume_boxes[{4 * int(defines['VOLUMES'])}]")
        _ints(info, "volume")
    stage = GPUStageInterfaceInfo("viewport_surface_iface")
    stage.flat("FLOAT", "surface_triangle")
    stage.smooth("VEC2", "surface_barycentric")
    stage.smooth("VEC3", "surface_point")
    info.vertex_out(stage)
    info.vertex_in(0, "FLOAT", "vertex_number")
    info.fragment_out(0, "VEC4", "radiance_sum")
    return {
        "vertex": ["data_lib", "viewport_surface_vert"],
        "fragment": [*_shading_files(defines), "viewport_surface_frag"],
    }


def viewport_probe(info, defines):
    from gpu.types import GPUStageInterfaceInfo

    slot = _field(info, defines, 0)
    _samplers(info, "spheres", first=slot)
    info.uniform_buf(1, "vec4", _VIEW)
    info.push_constant("FLOAT", "sphere_radius")
    _ints(info, "depth_only")
    stage = GPUStageInterfaceInfo("viewport_probe_iface")
    stage.flat("FLOAT", "sphere_mark")
    stage.flat("VEC3", "sphere_centre")
    stage.smooth("VEC3", "sphere_point")
    info.vertex_out(stage)
    info.vertex_in(0, "VEC2", "corner")
    info.depth_write("ANY")
    info.fragment_out(0, "VEC4", "radiance_sum")
    return {
        "vertex": ["data_lib", "viewport_probe_vert"],
        "fragment": [*_field_files(defines), "viewport_probe_frag"],
    }


def viewport_background(info, defines):
    _samplers(info, "world_texels")
    info.uniform_buf(1, "vec4", _VIEW)
    _full_screen(info, "viewport_background_iface")
    info.fragment_out(0, "VEC4", "radiance_sum")
    return {
        "vertex": ["viewport_background_vert"],
        "fragment": ["data_lib", "octahedral_lib", "cubemap_lib", "viewport_background_frag"],
    }


def viewport_display(info, defines):
    _samplers(info, "picture")
    _samplers(info, "picture_depth", kind="DEPTH_2D", first=1)
    _ints(info, "sample_count", "encoding", "tone_curve")
    info.push_constant("FLOAT", "exposure")
    info.push_constant("FLOAT", "gamma")
    info.push_constant("VEC2", "depth_scale_offset")
    _full_screen(info, "viewport_display_iface")
    info.depth_write("ANY")
    info.fragment_out(0, "VEC4", "frag_color")
    return {"vertex": ["viewport_display_vert"], "fragment": ["viewport_display_frag"]}


def _full_screen(info, interface: str) -> None:
    from gpu.types import GPUStageInterfaceInfo

    stage = GPUStageInterfaceInfo(interface)
    stage.smooth("VEC2", "place")
    info.vertex_out(stage)
    info.vertex_in(0, "VEC2", "corner")
