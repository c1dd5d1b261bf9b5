# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of a job: a JSON header and arrays, whose name holds the hash of their content.

A file is written under a temporary name, hashed and renamed, so a name with a hash is a whole file or none; one that
was damaged or cut off later no longer matches its name. The same content gives the same bytes::

    gridlight farm 1 ⏎
    {"arrays": [["light", "<f4", [4, 3]], …], …} ⏎
    array after array, C order

Only ``arrays`` needs numpy: schedulers check files without it.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

from ..core.errors import InputError

_MAGIC = b"gridlight farm 1\n"
SUFFIX = ".gridlight"
_CHUNK = 1 << 20


class Damaged(Exception):
    """A file does not match the hash in its name."""


def write(folder: Path, stem: str, header: dict, arrays: dict | None = None) -> Path:
    """Writes ``header``, plain values for JSON, and named ``arrays`` to ``folder``; returns ``stem-HASH.gridlight``.

    Raises:
        InputError: the folder cannot be written.
    """
    arrays = arrays or {}
    layout = [[name, array.dtype.newbyteorder("<").str, list(array.shape)] for name, array in arrays.items()]
    text = json.dumps({**header, "arrays": layout}, sort_keys=True, allow_nan=False, separators=(",", ":"))
    parts = [_MAGIC, text.encode(), b"\n"]
    parts += [array.astype(array.dtype.newbyteorder("<"), order="C", copy=False).tobytes() for array in arrays.values()]
    return write_bytes(folder, stem, parts)


def write_bytes(folder: Path, stem: str, parts: list[bytes], suffix: str = SUFFIX) -> Path:
    """Writes ``parts`` one after the other to ``folder / stem-HASH`` with ``suffix``; returns the path."""
    temporary = folder / f".{stem}.{os.getpid()}.part"
    digest = hashlib.sha256()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "wb") as file:
            for part in parts:
                digest.update(part)
                file.write(part)
            file.flush()
            os.fsync(file.fileno())
        path = folder / f"{stem}-{digest.hexdigest()}{suffix}"
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"cannot write to {folder}: {error.strerror}; make room or name another job folder") from None
    return path


def hash_in(path: Path) -> str:
    """The hash that the name of ``path`` states."""
    return path.name.removesuffix(path.suffix).rpartition("-")[2]


def check(path: Path) -> None:
    """Raises Damaged where the content of ``path`` is not what its name states."""
    digest = hashlib.sha256()
    try:
        with open(path, "rb") as file:
            while chunk := file.read(_CHUNK):
                digest.update(chunk)
    except OSError as error:
        raise Damaged(f"{path}: {error.strerror}") from None
    if digest.hexdigest() != hash_in(path):
        raise Damaged(f"{path} does not match the hash in its name: it was damaged or cut off")


def header(path: Path) -> dict:
    """The header of ``path``, which has been checked."""
    with open(path, "rb") as file:
        if file.readline() != _MAGIC:
            raise Damaged(f"{path} was written by another version of Gridlight")
        return json.loads(file.readline())


def arrays(path: Path) -> tuple[dict, dict]:
    """(header, arrays by name) of ``path``, which has been checked."""
    import numpy as np

    with open(path, "rb") as file:
        if file.readline() != _MAGIC:
            raise Damaged(f"{path} was written by another version of Gridlight")
        document = json.loads(file.readline())
        result = {}
        for name, dtype, shape in document.pop("arrays"):
            count = int(np.prod(shape, dtype=np.int64))
            result[name] = np.fromfile(file, dtype, count).reshape(shape)
    return document, result
