# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension registers, unregisters and registers again in Blender, and leaves nothing behind."""

import subprocess
import sys
from pathlib import Path

import bpy
import gridlight


def traces() -> dict:
    """Everything that an extension could leave in Blender, by place, as comparable sets."""
    handlers = {
        name: list(map(repr, getattr(bpy.app.handlers, name)))
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
    }
    operators = {f"{module}.{name}" for module in dir(bpy.ops) for name in dir(getattr(bpy.ops, module))}
    properties = {
        (kind, name)
        for kind in ("Scene", "Object", "Light", "Material", "WindowManager", "Collection", "World")
        for name in getattr(bpy.types, kind).bl_rna.properties.keys()
    }
    subclasses = {
        base: {cls.__name__ for cls in getattr(bpy.types, base).__subclasses__() if cls.is_registered}
        for base in ("Operator", "Panel", "PropertyGroup", "Menu", "RenderEngine", "AddonPreferences", "UIList")
    }
    return {
        "types": set(dir(bpy.types)),
        "operators": operators,
        "properties": properties,
        "handlers": handlers,
        "classes": subclasses,
        "keymaps": len(bpy.context.window_manager.keyconfigs.addon.keymaps)
        if bpy.context.window_manager.keyconfigs.addon
        else 0,
    }


def command_is_registered(capfd) -> bool:
    """Blender keeps no list of commands to look at, but complains about a second one of the same name."""
    capfd.readouterr()
    handle = bpy.utils.register_cli_command("gridlight", lambda argv: 0)
    bpy.utils.unregister_cli_command(handle)
    return "duplicate command" in "".join(capfd.readouterr())


def test_the_command_comes_and_goes(capfd):
    assert not command_is_registered(capfd)
    gridlight.register()
    assert command_is_registered(capfd)
    gridlight.unregister()
    assert not command_is_registered(capfd)


def test_register_unregister_register_leaves_nothing():
    before = traces()
    gridlight.register()
    first = traces()
    gridlight.unregister()
    assert traces() == before
    gridlight.register()
    assert traces() == first
    gridlight.unregister()
    assert traces() == before


def test_no_gpu_context_is_made_by_registering():
    """A GPU call at register breaks ``blender --background`` on machines without a driver."""
    program = (
        "import importlib.util, os, sys\n"
        f"root = {str(Path(gridlight.__file__).parent)!r}\n"
        "spec = importlib.util.spec_from_file_location('start', root + '/cli/__main__.py')\n"
        "start = importlib.util.module_from_spec(spec); spec.loader.exec_module(start)\n"
        "import bpy\n"
        "start.load_package().register()\n"
        "print('registered', flush=True); os._exit(0)\n"
    )
    # No EGL vendor at all: any GPU call would end this process.
    environment = {
        "PATH": "/usr/bin:/bin",
        "HOME": "/tmp",
        "__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent",
        "LIBGL_DRIVERS_PATH": "/nonexistent",
    }
    done = subprocess.run(
        [sys.executable, "-I", "-c", program], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0 and "registered" in done.stdout, done.stderr
