# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiled shaders: sources put together with their libraries, compiled once per set of defines."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import gpu

from ..core.errors import NoGpuError

_FOLDER = Path(__file__).parent
_GLSL = _FOLDER / "glsl"
_BINDINGS = [import_module(f".{path.stem}", __package__) for path in sorted(_FOLDER.glob("*create_infos.py"))]

# Never emptied: in Blender 4.5 and 5.0 the address of a freed shader can be reused, and the old program then runs
# silently.
_programs: dict[tuple, gpu.types.GPUShader] = {}

# Called with (name, shader) for every program that is asked for; what it returns takes the shader's place. For
# measurements alone (dispatch_profile.py).
observer: Callable[[str, gpu.types.GPUShader], Any] | None = None


def program(name: str, **defines) -> gpu.types.GPUShader:
    """The compiled shader ``name`` (a function of one of the modules of bindings) with ``defines``.

    A define of None or False is left out, True is defined empty.

    Raises:
        NoGpuError: the driver does not compile it.
    """
    key = _key(name, *defines.items())
    if key not in _programs:
        _programs[key] = _compile(name, dict(key[1]))
    return _programs[key] if observer is None else observer(name, _programs[key])


@cache
def _key(name: str, *defines: tuple[str, Any]) -> tuple[str, tuple]:
    return name, tuple(sorted((key, value) for key, value in defines if value is not None and value is not False))


def compiled() -> int:
    """Programs compiled so far."""
    return len(_programs)


def _compile(name: str, defines: dict) -> gpu.types.GPUShader:
    info = gpu.types.GPUShaderCreateInfo()
    info.define("EXACT", "" if gpu.platform.backend_type_get() == "METAL" else "precise")
    # Blender 5.2 strips the word itself from compute sources; it survives in a define.
    info.define("SHARED_", "shared")
    for key, value in defines.items():
        info.define(key, "" if value is True else str(value))
    bindings = next(getattr(module, name) for module in _BINDINGS if hasattr(module, name))
    stages = bindings(info, defines)
    for stage, files in stages.items():
        getattr(info, f"{stage}_source")("\n".join(_source(file) for file in files))
    try:
        return gpu.shader.create_from_info(info)
    except Exception as error:  # the binding raises bare Exception("Shader Compile Error, …") and nothing narrower
        raise NoGpuError(f"the graphics driver does not compile shader '{name}': {error}; update the driver") from error


@cache
def _source(file: str) -> str:
    return (_GLSL / f"{file}.glsl").read_text(encoding="utf-8")
