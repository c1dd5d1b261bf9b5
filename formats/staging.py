# SPDX-License-Identifier: GPL-3.0-or-later
"""Files appear whole or not at all: everything is written under temporary names and renamed at the end."""

from __future__ import annotations

import os
from pathlib import Path

from ..core.errors import InputError


class StagedFolder:
    """A folder that receives the files of one run together.

    Use as a context manager. ``path(name)`` gives the temporary path to write to, in the same folder and with the same
    suffix; leaving the block normally renames all of them, leaving it by an exception removes them, and the folder too
    where this run made it.

    Raises:
        InputError: on entry when the folder cannot be made or written, on exit when a file cannot take its name.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self._staged: dict[str, Path] = {}
        self._made: list[Path] = []

    def __enter__(self):
        try:
            for folder in reversed(missing_folders(self.folder)):
                folder.mkdir()
                self._made.insert(0, folder)
            probe = self._temporary("probe")
            probe.write_bytes(b"")
            probe.unlink()
        except OSError as error:
            self._discard()
            reason = error.strerror
            raise InputError(f"cannot write to the folder {self.folder}: {reason}; name another one") from None
        return self

    def __exit__(self, kind, error, _trace):
        if kind is None:
            try:
                for name, temporary in self._staged.items():
                    os.replace(temporary, self.folder / name)
            except OSError as reason:
                self._discard()
                raise InputError(
                    f"cannot write {self.folder / name}: {reason.strerror}; move it away or name another folder"
                ) from None
            return
        self._discard()
        if isinstance(error, OSError) and not isinstance(error, (BrokenPipeError, InterruptedError)):
            why = error.strerror or error
            raise InputError(f"cannot write to the folder {self.folder}: {why}; make room or name another") from None

    def path(self, name: str) -> Path:
        """Where to write what will be ``name``."""
        self._staged[name] = self._temporary(name)
        return self._staged[name]

    def staged(self, name: str) -> Path:
        """The temporary path of ``name``, which has been written already."""
        return self._staged[name]

    @property
    def names(self) -> list[str]:
        return list(self._staged)

    def _temporary(self, name: str) -> Path:
        stem, suffix = os.path.splitext(name)
        return self.folder / f".{stem}.{os.getpid()}.part{suffix}"

    def _discard(self):
        for temporary in self._staged.values():
            temporary.unlink(missing_ok=True)
        _remove_empty(self._made)


def missing_folders(folder) -> list[Path]:
    """``folder`` and those above it that do not exist, innermost first. Raises OSError for names that cannot be."""
    folder = Path(folder)
    return [path for path in (folder, *folder.parents) if not path.exists()]


def remove_leftovers(folder, process: int, made: list[Path]) -> None:
    """Removes what process number ``process`` left in ``folder`` when it was killed, and the folders it ``made``."""
    for leftover in Path(folder).glob(f".*.{process}.part*"):
        leftover.unlink(missing_ok=True)
    _remove_empty(made)


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:
            break  # not made after all, or something else has been put there in the meantime: it stays
