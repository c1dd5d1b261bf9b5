# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of every shader: one function per shader, of the shader's name.

Each takes a fresh ``GPUShaderCreateInfo`` and the defines of the variant, declares resources, and returns which files
make up which stage, libraries first.
"""

from __future__ import annotations

from ..core.conventions import DEPTH_EDGE
from ..core.lookup import INVALID_WEIGHT, LEAST_WEIGHT

NO_SURFACE = "1.0e30"


def _samplers(info, *names: str, kind: str = "FLOAT_2D", first: int = 0) -> int:
    for slot, name in enumerate(names, first):
        info.sampler(slot, kind, name)
    return first + len(names)


def _image(info, slot: int, name: str, *, layered: bool = False, pixel: str = "RGBA32F", access: str = "WRITE") -> None:
    info.image(slot, pixel, "FLOAT_2D_ARRAY" if layered else "FLOAT_2D", name, qualifiers=set(access.split("+")))


def _ints(info, *names: str) -> None:
    for name in names:
        info.push_constant("INT", name)


def _scene(info, defines: dict, first: int = 0, attributes: bool = True) -> int:
    """The scene's samplers: hierarchy and triangles; what surfaces are made of where ``attributes`` or holes need
    it."""
    names = ["bvh_nodes", "triangle_corners"]
    if attributes or "HAS_ALPHA" in defines:
        names += ["triangle_attributes", "materials"]
        if "HAS_IMAGES" in defines:
            names += ["image_table", "image_texels"]
    return _samplers(info, *names, first=first)


def _lookup(info, first: int) -> int:
    info.define("DEPTH_EDGE", str(DEPTH_EDGE))
    info.define("LEAST_WEIGHT", repr(LEAST_WEIGHT))
    info.define("INVALID_WEIGHT", repr(INVALID_WEIGHT))
    info.uniform_buf(0, "vec4", "grid_info[5]")
    return _samplers(info, "grid_nodes", "depth_moments", first=first)


def _surface_files(defines: dict) -> list[str]:
    return ["surface_lib"] if "HAS_ALPHA" in defines else []


def capture_trace_comp(info, defines):
    slot = _scene(info, defines, attributes=False)
    _samplers(info, "probe_slots", first=slot)
    _image(info, 0, "hits", layered=True)
    _ints(info, "first_slot")
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "cubemap_lib", *_surface_files(defines), "ray_lib", "capture_trace_comp"]}


def capture_raster(info, defines):
    from gpu.types import GPUStageInterfaceInfo

    slot = _scene(info, defines, attributes=False)
    _samplers(info, "probe_slots", "instances", first=slot)
    _ints(info, "first_slot", "triangle_count")
    info.push_constant("FLOAT", "near_distance")
    info.push_constant("FLOAT", "far_distance")
    stage = GPUStageInterfaceInfo("capture_raster_iface")
    stage.flat("FLOAT", "hit_triangle")
    stage.smooth("VEC2", "hit_barycentric")
    stage.smooth("VEC3", "hit_offset")
    info.vertex_out(stage)
    info.vertex_in(0, "FLOAT", "vertex_number")
    info.depth_write("ANY")
    info.fragment_out(0, "VEC4", "hit")
    return {
        "vertex": ["data_lib", "cubemap_lib", "capture_raster_vert"],
        "fragment": ["data_lib", *_surface_files(defines), "capture_raster_frag"],
    }


def surface_resolve_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _scene(info, defines)
    slot = _samplers(info, "probe_slots", "world_texels", first=slot)
    _samplers(info, "hits", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "geometry", layered=True)
    _image(info, 1, "albedo", layered=True)
    _image(info, 2, "emission", layered=True)
    _ints(info, "first_slot", "first_layer")
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "cubemap_lib", "surface_lib", "surface_resolve_comp"]}


def object_sightings_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    _samplers(info, "geometry", "emission", "source", kind="FLOAT_2D_ARRAY")
    _image(info, 0, "sightings")
    info.local_group_size(96, 1, 1)
    return {"compute": ["data_lib", "object_sightings_comp"]}


def probe_exits_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _samplers(info, "slots")
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "exits")
    info.local_group_size(6, 1, 1)
    return {"compute": ["data_lib", "cubemap_lib", "probe_exits_comp"]}


def probe_statistics_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    info.define("DEPTH_EDGE", str(DEPTH_EDGE))
    slot = _samplers(info, "texel_weights", "shells")
    _samplers(info, "geometry", "emission", "source", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "depth_moments", pixel="RG32F")
    _image(info, 1, "probe_shares")
    _ints(info, "first_slot", "first_layer")
    info.push_constant("FLOAT", "depth_clamp")
    info.local_group_size(DEPTH_EDGE * DEPTH_EDGE, 1, 1)
    return {"compute": ["data_lib", "cubemap_lib", "probe_statistics_comp"]}


def lookup_weights_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _lookup(info, 0)
    _samplers(info, "probe_slots", first=slot)
    _image(info, 0, "geometry", layered=True, access="READ+WRITE")
    _image(info, 1, "weights0", layered=True, pixel="RGBA16F")
    _image(info, 2, "weights1", layered=True, pixel="RGBA16F")
    _ints(info, "first_slot", "first_layer")
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "cubemap_lib", "lookup_lib", "lookup_weights_comp"]}


def _emitters(info, defines: dict, first: int) -> int:
    """Sampled emitters, where the scene has any; their materials are surfaces to the shader."""
    if "HAS_EMITTERS" not in defines:
        return first
    _ints(info, "emitter_count")
    info.push_constant("FLOAT", "emitter_reach")
    return _samplers(info, "emitters", first=first)


def _light_files(defines: dict) -> list[str]:
    """What it takes to light a point: rays, lamps and sampled emitters."""
    surfaces = ["surface_lib"] if "HAS_EMITTERS" in defines or "HAS_ALPHA" in defines else []
    emitters = ["emitter_lib"] if "HAS_EMITTERS" in defines else []
    return ["random_lib", *surfaces, "ray_lib", "direct_light_lib", *emitters]


def direct_light_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _scene(info, defines, attributes="HAS_EMITTERS" in defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "probe_slots", first=slot)
    _samplers(info, "geometry", "albedo", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "source", layered=True)
    _ints(info, "first_slot", "first_layer", "light_count", "samples", "seed")
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "cubemap_lib", *_light_files(defines), "direct_light_comp"]}


def emission_project_comp(info, defines):
    slot = _scene(info, defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "probe_slots", "texel_weights", first=slot)
    _samplers(info, "geometry", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "first_slot", "first_layer", "light_count", "samples", "seed")
    info.local_group_size(int(defines["GROUP"]), 1, 1)
    return {
        "compute": [
            "data_lib",
            "cubemap_lib",
            "spherical_harmonics_lib",
            *_light_files(defines),
            "emission_project_comp",
        ]
    }


def light_iterate_comp(info, defines):
    info.uniform_buf(0, "vec4", "grid_info[5]")
    slot = _samplers(info, "probe_slots", "texel_weights", "field_in")
    _samplers(info, "geometry", "albedo", "source", "weights0", "weights1", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "field_out")
    _ints(info, "first_slot", "first_layer", "read_field")
    info.local_group_size(int(defines["GROUP"]), 1, 1)
    return {"compute": ["data_lib", "cubemap_lib", "spherical_harmonics_lib", "field_lib", "light_iterate_comp"]}


def field_fill_comp(info, defines):
    _samplers(info, "inactive_nodes")
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "inactive_count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "field_fill_comp"]}


def field_change_comp(info, defines):
    _samplers(info, "probe_slots", "field_new", "field_old", "field_older")
    _image(info, 0, "change")
    _ints(info, "slot_count")
    info.local_group_size(256, 1, 1)
    return {"compute": ["data_lib", "field_change_comp"]}


def field_extrapolate_comp(info, defines):
    _samplers(info, "field_old")
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "element_count")
    info.push_constant("FLOAT", "factor")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "field_extrapolate_comp"]}


def preview_comp(info, defines):
    slot = _scene(info, defines)
    slot = _lookup(info, slot)
    _samplers(info, "lights", "field_in", "world_texels", "spheres", first=slot)
    _image(info, 0, "picture", access="READ+WRITE")
    _image(info, 1, "probe_picture", access="READ+WRITE")
    info.uniform_buf(1, "vec4", "view_info[5]")
    _ints(info, "light_count", "sample_index", "show_direct")
    info.local_group_size(8, 8, 1)
    return {
        "compute": [
            "data_lib",
            "cubemap_lib",
            "random_lib",
            "spherical_harmonics_lib",
            "surface_lib",
            "ray_lib",
            "direct_light_lib",
            "lookup_lib",
            "field_lib",
            "preview_comp",
        ]
    }


def gather_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _scene(info, defines)
    slot = _emitters(info, defines, slot)
    slot = _lookup(info, slot)
    slot = _samplers(info, "lights", "field_in", "world_texels", "probe_slots", first=slot)
    _samplers(info, "geometry", "albedo", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "source", layered=True, access="READ+WRITE")
    _ints(info, "first_slot", "first_layer", "light_count", "samples", "bounces", "seed")
    info.local_group_size(8, 8, 1)
    return {
        "compute": [
            "data_lib",
            "cubemap_lib",
            "spherical_harmonics_lib",
            *_light_files(defines | {"HAS_ALPHA": True}),
            "lookup_lib",
            "field_lib",
            "gather_comp",
        ]
    }
