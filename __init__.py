# SPDX-License-Identifier: GPL-3.0-or-later
"""Gridlight: grids of light probes, baked on the GPU."""


def register():
    from . import operators, panels

    operators.register()
    panels.register()


def unregister():
    from . import operators, panels

    panels.unregister()
    operators.unregister()
