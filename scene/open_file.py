# SPDX-License-Identifier: GPL-3.0-or-later
"""Open a .blend as data: nothing inside it is ever run, and a bad file ends in one plain line."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

import bpy

from ..core.errors import InputError
from .temporary import quiet_stdout

_BLEND, _GZIP, _ZSTD = b"BLENDER", b"\x1f\x8b", b"\x28\xb5\x2f\xfd"


def open_blend(path: str | Path) -> bpy.types.Scene:
    """Replace the current session's data by the file's and return its active scene.

    Text blocks marked to register, scripted drivers and anything else that is Python inside the file stays unexecuted,
    and the file's window layout is not loaded.

    Raises:
        InputError: the file is missing, is a folder, cannot be read, is not a .blend, or is damaged.
    """
    path = Path(path).expanduser()
    _check_readable_blend(path)
    try:
        with quiet_stdout():
            bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
    except RuntimeError as error:  # how operators report failure; Blender's own words are on standard error
        raise InputError(
            f"{path}: Blender {bpy.app.version_string} cannot open it, so it is damaged, cut short or from a newer "
            "Blender; copy it again from its source or open it in the Blender that wrote it"
        ) from error
    scene = bpy.context.scene
    if scene is None:
        raise InputError(f"{path}: holds no scene; save it again from Blender with at least one scene")
    return scene


def set_frame(scene: bpy.types.Scene, frame: int) -> None:
    """Evaluate ``scene`` at ``frame``; only for a file opened by ``open_blend``, a user's own session keeps its frame.

    Raises:
        InputError: ``frame`` is outside what Blender can represent.
    """
    limit = 1_048_574  # Blender's MAXFRAME
    if not -limit <= frame <= limit:
        raise InputError(f"--frame is {frame}; it must lie between {-limit} and {limit}")
    scene.frame_set(frame)


def _check_readable_blend(path: Path) -> None:
    """Refuse by the file's own bytes what Blender would refuse badly or not at all."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a .blend file in it")
    try:
        with path.open("rb") as file:
            magic = file.read(len(_BLEND))
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file; check the spelling and the folder") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error
    if not magic:
        raise InputError(f"{path}: is empty; save it again from Blender")
    if magic.startswith(_GZIP):
        magic = _gzip_start(path)
    if magic != _BLEND and not magic.startswith(_ZSTD):  # Python reads no Zstandard yet: there Blender decides
        raise InputError(f"{path}: is not a .blend file; name a file saved by Blender")


def _gzip_start(path: Path) -> bytes:
    """The first decompressed bytes; empty if the file is no valid gzip stream to its end."""
    try:
        with gzip.open(path, "rb") as file:
            start = file.read(len(_BLEND))
            while file.read(1 << 20):  # a truncated stream shows only at its end
                pass
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"{path}: is damaged or cut short ({error}); copy it again from its source") from error
    return start
