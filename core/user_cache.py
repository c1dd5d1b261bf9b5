# SPDX-License-Identifier: GPL-3.0-or-later
"""Small facts about this machine that are kept between runs, in the user's cache folder.

The first writer wins: processes that measure the same thing at once all go on with what the first one wrote. Nothing
here is needed: where the folder cannot be written or a file is damaged, it is as if nothing had been kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

Kept = TypeVar("Kept")


def folder() -> Path:
    """GRIDLIGHT_CACHE, or "gridlight" in the system's place for caches (XDG_CACHE_HOME on Linux).

    Raises:
        OSError: the user has no home.
    """
    named = os.environ.get("GRIDLIGHT_CACHE")
    if named:
        return _at_home(named)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or "~/AppData/Local"
    elif sys.platform == "darwin":
        base = "~/Library/Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return _at_home(base) / "gridlight"


def _at_home(path: str) -> Path:
    try:
        return Path(path).expanduser()
    except RuntimeError as error:
        raise FileNotFoundError(f"{path}: {error}") from None


def kept(name: str, key: str, check: Callable[[dict], Kept], measure: Callable[[], dict]) -> tuple[Kept, bool]:
    """What ``check`` makes of the values kept as ``name`` for ``key``, else of what ``measure`` returns, which is kept.

    Args:
        key: what the values depend on, any text; a file belongs to one key.
        check: turns kept values into the result; ValueError, TypeError or KeyError where they are none.
        measure: returns JSON values.

    Returns:
        (result, whether it is on disk now).
    """
    digest = hashlib.sha256(key.encode()).hexdigest()[:16]
    try:
        path = folder() / f"{name}-{digest}.json"
    except OSError:
        return check(measure()), False
    try:
        return _read(path, key, check), True
    except (*_DAMAGE, OSError) as error:
        damaged = not isinstance(error, FileNotFoundError)
    values = measure()
    try:
        _write(path, {"key": key, "values": values}, replace=damaged)
        return _read(path, key, check), True
    except (*_DAMAGE, OSError):
        return check(values), False


_DAMAGE = (ValueError, TypeError, KeyError)


def _read(path: Path, key: str, check: Callable[[dict], Kept]) -> Kept:
    """Raises OSError where there is no file, one of _DAMAGE where it is none of ours."""
    content = json.loads(path.read_text(encoding="utf-8"))
    if content["key"] != key:
        raise ValueError(f"{path} was written for another key")
    return check(content["values"])


def _write(path: Path, content: dict, replace: bool) -> None:
    """Whole or not at all. Without ``replace`` a file that has come up in the meantime stays."""
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(prefix=f".{path.stem}.", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump(content, file, indent=1)
        if replace:  # a damaged file
            os.replace(temporary, path)
        else:
            try:
                os.link(temporary, path)
            except FileExistsError:
                pass
            except OSError:  # a file system without links
                os.replace(temporary, path)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
