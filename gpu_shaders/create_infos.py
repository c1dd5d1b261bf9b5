# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of every shader: one function per shader, of the shader's name.

Each takes a fresh ``GPUShaderCreateInfo`` and the defines of the variant, declares resources, and returns which files
make up which stage, libraries first. Shaders are found by their name in any ``*create_infos.py`` (programs.py); what
begins with an underscore is no shader but what these modules share.
"""

from __future__ import annotations

from ..core import depth_map, lookup
from ..core.conventions import DEPTH_EDGE, DEPTH_SPREAD
from ..core.emitters import CANDIDATES, EMITTER_BOXES
from ..core.gradients import LEAST_COSINE
from ..core.images import HALF_MAX
from ..core.patches import SLOW

NO_SURFACE = "1.0e30"
RAY_FILES = ("offset_lib", "ray_lib", "passage_lib")  # what it takes to know what comes along a ray
# What shaders begin with that sum up a probe's texels.
_PROBE_FILES = ("data_lib", "octahedral_lib", "cubemap_lib", "spherical_harmonics_lib", "group_sum_lib")

_LOOKUP_CONSTANTS = (
    "AROUND_WEIGHT",
    "BEYOND",
    "FARTHEST",
    "HIDES",
    "INVALID_WEIGHT",
    "LEAST_WEIGHT",
    "OFF_SURFACE",
    "ON_BACK",
    "ON_BORDER",
    "SEEN_ENOUGH",
)
_DEPTH_MAP_CONSTANTS = "FARTHEST_PLANE", "LIKE_BACK", "NOT_FLAT", "ON_PLANE"


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
    it; and light linking where there is any."""
    names = ["bvh_nodes", "triangle_corners"]
    if attributes or "HAS_ALPHA" in defines:
        names += ["triangle_attributes", "materials"]
        if "HAS_IMAGES" in defines:
            names += ["image_table", "image_texels"]
        if "HAS_FAINT_GLOSS" in defines:
            names.append("faint_gloss")
    if "HAS_TINT" in defines:
        names.append("tints")
    if "HAS_LINKS" in defines:
        names.append("links")
    return _samplers(info, *names, first=first)


def _sheets(info, defines: dict, first: int, *arrays: str) -> int:
    """Shares of sheets, and ``arrays`` with numbers of them, where the scene has sheets."""
    return _samplers(info, "sheets", *arrays, first=first) if "HAS_SHEETS" in defines else first


def _sheet_files(defines: dict) -> list[str]:
    return ["sheet_lib"] if "HAS_SHEETS" in defines else []


def _lookup(info, first: int) -> int:
    info.define("DEPTH_EDGE", str(DEPTH_EDGE))
    for name in _DEPTH_MAP_CONSTANTS:
        info.define(name, repr(getattr(depth_map, name)))
    for name in _LOOKUP_CONSTANTS:
        info.define(name, repr(getattr(lookup, name)))
    info.uniform_buf(0, "vec4", "grid_info[5]")
    return _samplers(info, "grid_nodes", "sights", first=first)


def _surface_files(defines: dict) -> list[str]:
    return ["surface_lib"] if "HAS_ALPHA" in defines else []


def _couplings(info, defines: dict, first: int) -> int:
    """How surfaces at places take light of grazing angles, where that is known."""
    return _samplers(info, "couplings", first=first) if "HAS_COUPLING" in defines else first


def _coupling_files(defines: dict) -> list[str]:
    return ["coupling_lib"] if "HAS_COUPLING" in defines else []


def image_mip_comp(info, defines):
    _image(info, 0, "texels", access="READ+WRITE")
    _ints(info, "before_start", "before_width", "before_height", "start", "width", "height")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "image_mip_comp"]}


def image_store_comp(info, defines):
    info.define("HALF_MAX", repr(HALF_MAX))
    _samplers(info, "texels")
    _image(info, 0, "halves", pixel="RGBA16F")
    _ints(info, "first", "count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "image_store_comp"]}


def capture_trace_comp(info, defines):
    slot = _scene(info, defines, attributes=False)
    _samplers(info, "probe_slots", first=slot)
    _image(info, 0, "hits", layered=True)
    _ints(info, "first_slot")
    info.local_group_size(8, 8, 1)
    files = [*_surface_files(defines), "offset_lib", "ray_lib", "capture_trace_comp"]
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", *files]}


def capture_raster(info, defines):
    from gpu.types import GPUStageInterfaceInfo

    slot = _scene(info, defines, attributes=False)
    _samplers(info, "probe_slots", "instances", first=slot)
    _ints(info, "first_slot", "triangle_count")
    info.push_constant("FLOAT", "near_distance")
    info.push_constant("FLOAT", "far_distance")
    stage = GPUStageInterfaceInfo("capture_raster_iface")
    stage.flat("FLOAT", "hit_triangle")
    stage.flat("FLOAT", "hit_layer")
    info.vertex_out(stage)
    info.vertex_in(0, "FLOAT", "vertex_number")
    info.depth_write("ANY")
    info.fragment_out(0, "VEC4", "hit")
    return {
        "vertex": ["data_lib", "octahedral_lib", "cubemap_lib", "capture_raster_vert"],
        "fragment": ["data_lib", "octahedral_lib", "cubemap_lib", *_surface_files(defines), "capture_raster_frag"],
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
    files = ["surface_lib", *RAY_FILES, "surface_resolve_comp"]
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", *files]}


def object_sightings_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _mirrored(info, defines, _samplers(info, "patch_irradiance", "triangle_attributes"))
    _samplers(info, "geometry", "albedo", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "sightings")
    info.local_group_size(96, 1, 1)
    return {"compute": ["data_lib", "texel_light_lib", "object_sightings_comp"]}


def probe_exits_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _samplers(info, "slots")
    _samplers(info, "geometry", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "exits")
    info.local_group_size(6, 1, 1)
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", "probe_exits_comp"]}


def probe_statistics_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    info.define("DEPTH_EDGE", str(DEPTH_EDGE))
    info.define("DEPTH_SPREAD", repr(DEPTH_SPREAD))
    info.define("LEAST_COSINE", repr(depth_map.LEAST_COSINE))
    slot = _samplers(info, "texel_weights", "shells", "patch_irradiance", "triangle_attributes")
    slot = _mirrored(info, defines, slot)
    _samplers(info, "geometry", "albedo", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "depth_statistics")
    _image(info, 1, "probe_shares")
    _ints(info, "first_slot", "first_layer")
    info.push_constant("FLOAT", "depth_clamp")
    info.local_group_size(DEPTH_EDGE * DEPTH_EDGE, 1, 1)
    return {"compute": ["data_lib", "octahedral_lib", "cubemap_lib", "texel_light_lib", "probe_statistics_comp"]}


def _emitters(info, defines: dict, first: int) -> int:
    """Sampled emitters, where the scene has any; their materials are surfaces to the shader."""
    if "HAS_EMITTERS" not in defines:
        return first
    info.define("CANDIDATES", str(CANDIDATES))
    info.define("EMITTER_BOXES", str(EMITTER_BOXES))
    _ints(info, "emitter_count")
    info.push_constant("FLOAT", "emitter_reach")
    return _samplers(info, "emitters", first=first)


def _light_files(defines: dict) -> list[str]:
    """What it takes to light a point: rays, lamps and sampled emitters."""
    surfaces = ["surface_lib"] if "HAS_EMITTERS" in defines or "HAS_ALPHA" in defines else []
    emitters = ["emitter_lib"] if "HAS_EMITTERS" in defines else []
    return ["random_lib", *surfaces, *RAY_FILES, "direct_light_lib", *emitters, "light_rays_lib"]


def _mirrored(info, defines: dict, first: int) -> int:
    """What texel_light_lib reads of what texels mirror, where the scene has glossy surfaces."""
    return _samplers(info, "mirrored", "mirrored_irradiance", first=first) if "REFLECTIONS" in defines else first


def _group_sums(info, defines: dict) -> None:
    info.define("SUMS", "COEFFICIENTS")
    info.local_group_size(int(defines["GROUP"]), 1, 1)


def field_project_comp(info, defines):
    slot = _samplers(info, "probe_layers", "texel_weights", "patch_irradiance", "emitted")
    slot = _mirrored(info, defines, slot)
    _samplers(info, "albedo", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "field")
    _ints(info, "first_slot", "own_texels")
    _group_sums(info, defines)
    return {"compute": [*_PROBE_FILES, "texel_sum_lib", "texel_light_lib", "field_project_comp"]}


def field_gradient_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _samplers(info, "probe_layers", "texel_edges", "texel_weights", "patch_irradiance", "emitted_gradient")
    slot = _mirrored(info, defines, slot)
    _samplers(info, "geometry", "albedo", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "field_gradient")
    _ints(info, "first_slot", "own_texels")
    info.push_constant("FLOAT", "nearest")
    _group_sums(info, defines)
    return {"compute": [*_PROBE_FILES, "texel_light_lib", "probe_emitter_lib", "field_gradient_comp"]}


def sun_project_comp(info, defines):
    slot = _scene(info, defines, attributes=False)
    _samplers(info, "lights", "probe_slots", "probe_layers", first=slot)
    _image(info, 0, "field", access="READ+WRITE")
    _ints(info, "first_slot", "first_sun", "light_count", "seed")
    _group_sums(info, defines)
    files = ["data_lib", "spherical_harmonics_lib", "group_sum_lib", *_light_files(defines), "sun_project_comp"]
    return {"compute": files}


def texel_hits_comp(info, defines):
    info.define("NO_SURFACE", NO_SURFACE)
    slot = _samplers(info, "probe_slots", "triangle_corners")
    slot = _samplers(info, "geometry", "albedo", kind="FLOAT_2D_ARRAY", first=slot)
    _sheets(info, defines, slot)
    _image(info, 0, "hits")
    if "HAS_SHEETS" in defines:
        _image(info, 1, "hit_sheets", pixel="R32F")
    _ints(info, "first_slot", "first_layer")
    info.local_group_size(8, 8, 1)
    files = ["data_lib", "octahedral_lib", "cubemap_lib", "offset_lib", *_sheet_files(defines), "texel_hits_comp"]
    return {"compute": files}


def texel_patches_comp(info, defines):
    _samplers(info, "patches")
    _image(info, 0, "albedo", layered=True, access="READ+WRITE")
    _ints(info, "first_layer")
    info.local_group_size(8, 8, 1)
    return {"compute": ["data_lib", "texel_patches_comp"]}


def _part_of_light(info, defines: dict) -> None:
    """Which lamps direct_light_lib takes: none where emitters are sampled, which are a part by themselves."""
    if "HAS_EMITTERS" in defines:
        info.define("FIRST_LIGHT", "0")
        info.define("LAMPS_A_RAY", "1")
        info.define("light_count", "0")
        return
    _ints(info, "first_light", "light_count", "lamps_a_ray")
    info.define("FIRST_LIGHT", "first_light")
    info.define("LAMPS_A_RAY", "lamps_a_ray")


def patch_spread_comp(info, defines):
    slot = _scene(info, defines, attributes="HAS_EMITTERS" in defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "patch_points", first=slot)
    _sheets(info, defines, slot, "sheet_numbers")
    _image(info, 0, "spread", pixel="RG32F")
    _ints(info, "first_patch", "patch_count", "point_count", "seed")
    _part_of_light(info, defines)
    info.local_group_size(64, 1, 1)
    files = ["data_lib", "octahedral_lib", *_light_files(defines), *_sheet_files(defines), "patch_spread_comp"]
    return {"compute": files}


def _patch_lists(info) -> None:
    """What patch_lists_lib reads but `patches`."""
    for name in ("list_first", "list_count", "list_samples"):
        info.push_constant("IVEC4", name)
    _ints(info, "samples_each")


def patch_direct_comp(info, defines):
    slot = _scene(info, defines, attributes="HAS_EMITTERS" in defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "patches", "patch_points", first=slot)
    _couplings(info, defines, _sheets(info, defines, slot, "sheet_numbers"))
    _image(info, 0, "sums")
    _patch_lists(info)
    _ints(info, "first_key", "seed")
    _part_of_light(info, defines)
    info.local_group_size(64, 1, 1)
    files = ["data_lib", "octahedral_lib", *_coupling_files(defines), *_light_files(defines), *_sheet_files(defines)]
    return {"compute": [*files, "patch_lists_lib", "patch_direct_comp"]}


def patch_mean_comp(info, defines):
    _samplers(info, "patches", "sums")
    _image(info, 0, "direct", access="READ+WRITE")
    _patch_lists(info)
    _ints(info, "begins")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_lists_lib", "patch_mean_comp"]}


def _one_group(info) -> None:
    """A group as large as every device takes, which goes over all there is."""
    info.define("THREADS", "1024")
    info.local_group_size(1024, 1, 1)


def patch_change_comp(info, defines):
    _samplers(info, "irradiance_new", "irradiance_old", "irradiance_older", "patch_seen", "brightest")
    _image(info, 0, "change")
    _ints(info, "patch_count", "result")
    info.define("SLOW", repr(SLOW))
    info.push_constant("FLOAT", "unseen")
    info.push_constant("FLOAT", "tolerance")
    info.define("THREADS", "256")
    info.local_group_size(256, 1, 1)
    return {"compute": ["data_lib", "patch_slow_lib", "patch_change_comp"]}


def patch_extrapolate_comp(info, defines):
    _samplers(info, "irradiance_old")
    _image(info, 0, "irradiance", access="READ+WRITE")
    _ints(info, "patch_count")
    info.push_constant("FLOAT", "factor")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_extrapolate_comp"]}


def emission_project_comp(info, defines):
    info.define("LEAST_COSINE", repr(LEAST_COSINE))
    slot = _scene(info, defines)
    slot = _emitters(info, defines, slot)
    slot = _samplers(info, "lights", "probe_slots", "probe_layers", "texel_weights", first=slot)
    _samplers(info, "geometry", "emission", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "emitted")
    _image(info, 1, "emitted_gradient")
    _ints(info, "first_slot", "light_count", "seed")
    info.push_constant("FLOAT", "nearest")
    _group_sums(info, defines)
    return {
        "compute": [
            *_PROBE_FILES,
            "texel_sum_lib",
            "spherical_harmonics_gradient_lib",
            "probe_emitter_lib",
            *_light_files(defines),
            "emission_project_comp",
        ]
    }
