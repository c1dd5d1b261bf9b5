# SPDX-License-Identifier: GPL-3.0-or-later
"""Gridlight: grids of light probes, baked on the GPU."""


def register():
    from . import cli, operators, panels, viewport

    operators.register()
    viewport.register()
    panels.register()
    cli.register()


def unregister():
    from . import cli, operators, panels, viewport

    cli.unregister()
    panels.unregister()
    viewport.unregister()
    operators.unregister()
