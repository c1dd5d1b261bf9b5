# SPDX-License-Identifier: GPL-3.0-or-later
"""Bindings of the shaders that find patches and choose which to light: patch_finder.py, patch_direct.py. Same form as
create_infos.py."""

from __future__ import annotations

from ..core.patches import DARK, ERRORS, POINTS, SHADOWED, SLOW
from .create_infos import _image, _ints, _one_group, _samplers, _scene, _surface_files


def _atomic(info, slot: int, name: str) -> None:
    info.image(slot, "R32UI", "UINT_2D_ATOMIC", name, qualifiers={"READ", "WRITE"})


def _linear(info, *files: str) -> dict:
    info.define("POINTS", str(POINTS))
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", *files]}


def patch_keys_comp(info, defines):
    slot = _samplers(info, "hits", "cell_rule")
    if "HAS_SHEETS" in defines:
        slot = _samplers(info, "hit_sheets", first=slot)
    if "HAS_VIEW" in defines:
        _samplers(info, "probe_slots", first=slot)
        _ints(info, "first_slot")
    _image(info, 0, "hit_keys")
    _image(info, 1, "bound", pixel="R32F", access="READ+WRITE")
    _ints(info, "hit_count", "coarser", "only_lost")
    info.push_constant("FLOAT", "without_surface")
    return _linear(info, "octahedral_lib", "random_lib", "patch_cell_lib", "patch_keys_comp")


def patch_claim_comp(info, defines):
    info.define("CELL_TABLE", "")
    _samplers(info, "items", "bound", "hit_keys", "patch_keys")
    _atomic(info, 0, "table")
    _atomic(info, 1, "leaders")
    _image(info, 2, "slots", pixel="R32F")
    _ints(info, "item_count", "hit_count", "variant", "table_mask")
    return _linear(info, "random_lib", "patch_cell_lib", "patch_claim_comp")


def _pending(info, defines: dict, *names: str) -> int:
    """What patch_pending_lib reads, and samplers ``names``; returns the first free image."""
    leads = "LEADERS" in defines
    _samplers(info, "items", "bound", *(["slots"] if leads else []), *names)
    _ints(info, "item_count", "hit_count")
    if leads:
        _atomic(info, 0, "table")
        _atomic(info, 1, "leaders")
    return 2 if leads else 0


def _due(info, defines: dict, *names: str) -> int:
    """The same for patch_due_lib."""
    parts = int(defines["PARTS"])
    _samplers(info, *(f"spread{part}" for part in range(parts)), "lights", "mean_lights", *names)
    _ints(info, "patch_count")
    for part in range(parts):
        _image(info, part, f"classes{part}", pixel="R32F", access="READ+WRITE")
    info.define("SHADOWED", repr(SHADOWED))
    info.define("DARK", repr(DARK))
    info.define("ERRORS", f"vec3{ERRORS}")
    return parts


_PENDING_FILES = ("random_lib", "patch_cell_lib", "patch_pending_lib")


def _compaction(info, *files: str, places: bool = True) -> dict:
    info.local_group_size(256, 1, 1)
    info.define("POINTS", str(POINTS))
    if places:
        info.define("PLACES", "")
    return {"compute": ["data_lib", *files]}


def compact_count_comp(info, defines):
    picks_due = "PARTS" in defines
    _image(info, _due(info, defines) if picks_due else _pending(info, defines), "block_counts", pixel="R32F")
    files = ["patch_due_lib"] if picks_due else _PENDING_FILES
    return _compaction(info, *files, "compaction_lib", "compact_count_comp", places=False)


def patch_number_comp(info, defines):
    image = _pending(info, defines, "block_counts", "total_in", "hit_keys", "hits")
    _image(info, image, "total_out", pixel="R32F")
    _image(info, image + 1, "patch_keys")
    _image(info, image + 2, "patch_points")
    if "HAS_SHEETS" in defines:
        _image(info, image + 3, "patch_sheets", pixel="R32F")
    _ints(info, "variant")
    return _compaction(info, *_PENDING_FILES, "compaction_lib", "patch_number_comp")


def compact_list_comp(info, defines):
    image = _pending(info, defines, "block_counts")
    _image(info, image, "total_out", pixel="R32F")
    _image(info, image + 1, "listed", pixel="R32F")
    return _compaction(info, *_PENDING_FILES, "compaction_lib", "compact_list_comp")


def patch_due_comp(info, defines):
    image = _due(info, defines, "block_counts")
    _image(info, image, "due", pixel="R32F")
    _image(info, image + 1, "due_counts", pixel="R32F")
    _ints(info, "result")
    return _compaction(info, "patch_due_lib", "compaction_lib", "patch_due_comp")


def patch_join_comp(info, defines):
    slot = _scene(info, defines, attributes=False)
    slot = _samplers(info, "items", "slots", "hits", "patch_points", "total_before", first=slot)
    _samplers(info, "table", "leaders", kind="UINT_2D", first=slot)
    _image(info, 0, "bound", pixel="R32F", access="READ+WRITE")
    _atomic(info, 1, "candidates")
    if "HAS_VIEW" in defines:
        _image(info, 2, "seen", pixel="R32F")
    _ints(info, "item_count", "hit_count", "first_new", "row_length", "is_last")
    return _linear(info, *_sight_files(defines), "patch_join_comp")


def patch_look_comp(info, defines):
    slot = _scene(info, defines, attributes=False)
    slot = _samplers(info, "hits", "hit_keys", "patch_keys", "patch_points", first=slot)
    _samplers(info, "table", kind="UINT_2D", first=slot)
    _image(info, 0, "bound", pixel="R32F", access="READ+WRITE")
    _ints(info, "hit_count", "table_mask")
    return _linear(info, *_sight_files(defines), "patch_look_comp")


def _sight_files(defines: dict) -> list[str]:
    cells = ["octahedral_lib", "random_lib", "patch_cell_lib"]
    return [*cells, *_surface_files(defines), "offset_lib", "ray_lib", "patch_sight_lib"]


def patch_points_comp(info, defines):
    slot = _samplers(info, "hits")
    _samplers(info, "candidates", kind="UINT_2D", first=slot)
    _image(info, 0, "patch_points", access="READ+WRITE")
    _ints(info, "first_new", "patch_count")
    return _linear(info, "patch_points_comp")


def patch_seen_comp(info, defines):
    slot = _samplers(info, "probe_layers", *(["mirrored"] if "REFLECTIONS" in defines else []))
    _samplers(info, "albedo", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "seen", pixel="R32F")
    return _linear(info, "patch_seen_comp")


def probe_hollow_comp(info, defines):
    info.define("SLOW", repr(SLOW))
    slot = _samplers(info, "probe_layers", "irradiance_new", "irradiance_old", "irradiance_older")
    _samplers(info, "albedo", kind="FLOAT_2D_ARRAY", first=slot)
    _image(info, 0, "shares", pixel="R32F")
    info.push_constant("FLOAT", "tolerance")
    return _linear(info, "patch_slow_lib", "probe_hollow_comp")


def patch_table_comp(info, defines):
    _samplers(info, "patch_keys")
    _atomic(info, 0, "table")
    _ints(info, "patch_count", "table_mask")
    return _linear(info, "random_lib", "patch_cell_lib", "patch_table_comp")


def copy_elements_comp(info, defines):
    _samplers(info, "source", kind=defines["KIND"])
    info.image(0, defines["PIXEL"], defines["KIND"], "target", qualifiers={"WRITE"})
    _ints(info, "first", "count")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "copy_elements_comp"]}


def fill_elements_comp(info, defines):
    info.image(0, defines["PIXEL"], defines["KIND"], "target", qualifiers={"WRITE"})
    _ints(info, "first", "count")
    info.push_constant("INT" if "INTEGERS" in defines else "FLOAT", "value")
    if "TIMES" in defines:
        _samplers(info, "factors")
        _ints(info, "factor")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "fill_elements_comp"]}


def patch_reduce_comp(info, defines):
    _samplers(info, "values", *(["others"] if "LARGEST" in defines else []))
    _image(info, 0, "results", pixel="R32F")
    _ints(info, "first", "stop", "result")
    _one_group(info)
    return {"compute": ["data_lib", "patch_reduce_comp"]}


def patch_add_comp(info, defines):
    _samplers(info, *(f"term{number}" for number in range(defines["TERMS"])))
    _image(info, 0, "total", access="READ+WRITE")
    _ints(info, "patch_count", "begins")
    info.local_group_size(64, 1, 1)
    return {"compute": ["data_lib", "patch_add_comp"]}
