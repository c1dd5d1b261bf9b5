# SPDX-License-Identifier: GPL-3.0-or-later
"""Identifiers of all operators, menus, panels and lists, in one place."""

ADD_VOLUME = "gridlight.add_volume"
FIT_VOLUME = "gridlight.fit_volume"
SELECT_VOLUME = "gridlight.select_volume"
ADD_GALLERY = "gridlight.add_gallery"

PLACE_PROBES = "gridlight.place_probes"
CLEAR_PROBES = "gridlight.clear_probes"
RESET_PROBES = "gridlight.reset_probes"

BAKE = "gridlight.bake"
CANCEL_BAKE = "gridlight.cancel_bake"
RELIGHT = "gridlight.relight"
CLEAR_BAKE = "gridlight.clear_bake"
CHECK_BAKE = "gridlight.check_bake"

PREVIEW = "gridlight.preview"
PICK_PROBE = "gridlight.pick_probe"
EXPLORE = "gridlight.explore"

EXPORT = "gridlight.export"
IMPORT = "gridlight.import_field"
REPORT = "gridlight.report"

CATEGORY = "Gridlight"  # the sidebar's tab
LIGHT_LIST = "GRIDLIGHT_UL_lights"
