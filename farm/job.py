# SPDX-License-Identifier: GPL-3.0-or-later
"""A job: the folder that holds a plan and what its shards have produced. Standard library only.

    plan-HASH.json          frames, volumes, settings, shards, device
    objects/                arrays of the scenes, and which probes are active
    votes/00003-HASH…       iteration 0: what the probes of a shard see of objects' back faces
    verdict/000-001-HASH…   the barrier: all votes of frame 0, volume 1 together
    light/00003-HASH…       iteration 1: the light of a shard's probes
    result/                 what ``bake`` leaves: probe files, pictures, report
    events.jsonl            what happened: shards that were done, failed, were found damaged

A shard is a number of blocks (core/blocks.py) of one volume at one frame. An output counts only while it matches the
hash in its name, the plan, and, in iteration 1, the verdict; anything else is as good as not there.
"""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import InputError
from . import container

VERSION = 2  # of plans
ITERATIONS = 2
_FOLDERS = ("votes", "light")  # of the iterations' outputs


@dataclass(frozen=True)
class Shard:
    """``blocks`` of volume number ``volume`` at frame number ``frame``, both counted from 0 in the plan."""

    number: int
    frame: int
    volume: int
    blocks: tuple[int, ...]

    @property
    def group(self) -> tuple[int, int]:
        """Frame and volume: what is merged together."""
        return self.frame, self.volume


class Job:
    """The job in ``folder``.

    Raises:
        InputError: there is no plan, or a damaged one.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        plans = sorted(self.folder.glob("plan-*.json"))
        if not plans:
            raise InputError(f"{folder} holds no plan; make one with 'gridlight farm plan FILE.blend -o {folder}'")
        if len(plans) > 1:
            raise InputError(f"{folder} holds {len(plans)} plans; keep one, or plan anew in an empty folder")
        try:
            container.check(plans[0])
        except container.Damaged as error:
            raise InputError(f"{error}; plan anew in an empty folder") from None
        self.path = plans[0]
        self.key = container.hash_in(plans[0])
        self.plan = json.loads(plans[0].read_text(encoding="utf-8"))
        if self.plan.get("version") != VERSION:
            raise InputError(f"{plans[0]} is of another version of Gridlight; plan anew in an empty folder")
        self.shards = [Shard(i, f, v, tuple(blocks)) for i, (f, v, blocks) in enumerate(self.plan["shards"])]
        self._checked: dict[Path, tuple] = {}

    @property
    def objects(self) -> Path:
        return self.folder / "objects"

    @property
    def groups(self) -> list[tuple[int, int]]:
        """Every (frame, volume), in order."""
        return sorted({shard.group for shard in self.shards})

    def shards_of(self, group: tuple[int, int]) -> list[Shard]:
        return [shard for shard in self.shards if shard.group == group]

    def shard(self, number: int) -> Shard:
        if not 0 <= number < len(self.shards):
            raise InputError(f"shard {number} does not exist: the plan has 0 to {len(self.shards) - 1}")
        return self.shards[number]

    def describe(self, shard: Shard) -> str:
        """ "shard 3 (frame 7, volume 'Hall', blocks 4 to 7)"."""
        frame = self.plan["frames"][shard.frame]
        volume = frame["volumes"][shard.volume]["name"]
        first, last = shard.blocks[0], shard.blocks[-1]
        blocks = f"block {first}" if first == last else f"blocks {first} to {last}"
        return f"shard {shard.number} (frame {frame['frame']}, volume '{volume}', {blocks})"

    # Outputs
    # ------------------------------------------------------------------------------------------------------------------

    def write_output(self, iteration: int, shard: Shard, header: dict, arrays: dict) -> Path:
        """The output of ``shard``; replaces any other."""
        header = {**header, "plan": self.key, "iteration": iteration, "shard": shard.number}
        return self._replace(_FOLDERS[iteration], f"{shard.number:05d}", header, arrays)

    def output(self, iteration: int, shard: Shard) -> Path | None:
        """The whole, valid output of ``shard``; None where it must be made. Damaged ones are removed."""
        if iteration == 0:
            return self._valid(_FOLDERS[0], f"{shard.number:05d}", {})
        verdict = self.verdict(shard.group)
        if verdict is None:
            return None
        return self._valid(_FOLDERS[1], f"{shard.number:05d}", {"verdict": container.hash_in(verdict)})

    def write_verdict(self, group: tuple[int, int], header: dict, arrays: dict) -> Path:
        return self._replace("verdict", _group_stem(group), {**header, "plan": self.key}, arrays)

    def verdict(self, group: tuple[int, int]) -> Path | None:
        """The votes of ``group`` together; None before the barrier."""
        return self._valid("verdict", _group_stem(group), {})

    def voted(self, group: tuple[int, int]) -> set[int]:
        """Numbers of the shards whose votes the verdict holds; none before the barrier."""
        path = self.verdict(group)
        return set() if path is None else set(self._header(path)["voted"])

    def _replace(self, folder: str, stem: str, header: dict, arrays: dict) -> Path:
        path = container.write(self.folder / folder, stem, header, arrays)
        for other in (self.folder / folder).glob(f"{stem}-*{container.SUFFIX}"):
            if other != path:
                other.unlink(missing_ok=True)
        return path

    def _valid(self, folder: str, stem: str, expected: dict) -> Path | None:
        expected = {**expected, "plan": self.key}
        for path in sorted((self.folder / folder).glob(f"{stem}-*{container.SUFFIX}")):
            try:
                stated = self._header(path)
            except container.Damaged as error:
                self.event("damaged", file=str(path.relative_to(self.folder)), reason=str(error))
                path.unlink(missing_ok=True)
                continue
            except FileNotFoundError:
                continue  # another process has just replaced it
            if all(stated.get(name) == value for name, value in expected.items()):
                return path
        return None

    def _header(self, path: Path) -> dict:
        """The checked header; content is hashed anew whenever the file may have changed."""
        status = os.stat(path)
        mark = (status.st_size, status.st_mtime_ns, status.st_ino)
        known = self._checked.get(path)
        if known is None or known[0] != mark:
            container.check(path)
            self._checked[path] = known = (mark, container.header(path))
        return known[1]

    # Events
    # ------------------------------------------------------------------------------------------------------------------

    def event(self, kind: str, **details) -> None:
        """Adds a line to the job's log. Lines are short enough to be written at once, by several processes too."""
        line = json.dumps({"time": round(time.time(), 3), "event": kind, **details}) + "\n"
        handle = os.open(self.folder / "events.jsonl", os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(handle, line.encode())
        finally:
            os.close(handle)

    def events(self) -> list[dict]:
        try:
            lines = (self.folder / "events.jsonl").read_text(encoding="utf-8").splitlines()
        except FileNotFoundError:
            return []
        return [json.loads(line) for line in lines if line.endswith("}")]


def _group_stem(group: tuple[int, int]) -> str:
    return "{:05d}-{:03d}".format(*group)
