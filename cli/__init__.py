# SPDX-License-Identifier: GPL-3.0-or-later
"""Headless commands, the same ones for ``./gridlight`` and ``blender --command gridlight``."""

_registered: list = []


def register():
    import bpy

    _registered.append(bpy.utils.register_cli_command("gridlight", _execute))


def unregister():
    import bpy

    while _registered:
        bpy.utils.unregister_cli_command(_registered.pop())


def _execute(argv: list[str]) -> int:
    from .main import main

    return main(argv, in_blender=True)
