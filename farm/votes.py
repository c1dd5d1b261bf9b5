# SPDX-License-Identifier: GPL-3.0-or-later
"""The barrier between the iterations: votes of all shards of a volume, together."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from ..core.errors import InputError
from ..core.orientation import ShellVote
from . import container
from .job import Job


def read_vote(path: Path) -> ShellVote:
    """The vote in ``path``, of a shard or of all, which has been checked."""
    header, arrays = container.arrays(path)
    vote = ShellVote(len(arrays["behind"]))
    vote.behind, vote.lit = arrays["behind"], arrays["lit"]
    vote.any_light, vote.sees_light = header["any_light"], header["sees_light"]
    return vote


def merge_votes(job: Job, group: tuple[int, int], without: Collection[int] = ()) -> Path:
    """Writes the verdict of ``group`` and returns it. Shards ``without`` have no vote; where they have one in fact, it
    counts.

    Raises:
        InputError: the votes of other shards are missing.
    """
    together, missing, voted = None, [], []
    for shard in job.shards_of(group):
        path = job.output(0, shard)
        if path is None:
            if shard.number not in without:
                missing.append(shard)
            continue
        vote = read_vote(path)
        voted.append(shard.number)
        if together is None:
            together = ShellVote(len(vote.behind))
        together.merge(vote)
    if missing:
        raise InputError(
            f"{len(missing)} votes are missing, the first of {job.describe(missing[0])}: run 'gridlight farm shard "
            f"{job.folder} --iteration 0 --shard {missing[0].number}', or 'gridlight farm run {job.folder}'"
        )
    if together is None:
        raise InputError(f"no shard of frame {group[0]}, volume {group[1]} has voted: nothing can be merged")
    header = {"any_light": bool(together.any_light), "sees_light": bool(together.sees_light), "voted": voted}
    return job.write_verdict(group, header, {"behind": together.behind, "lit": together.lit})
