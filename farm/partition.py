# SPDX-License-Identifier: GPL-3.0-or-later
"""Which blocks make a shard."""

from __future__ import annotations


def divide(active: dict[int, int], shards: int | None) -> list[list[int]]:
    """The blocks of one volume, numbers ascending, in at most ``shards`` runs of neighbours with about as many active
    probes each; None: a shard for every block. ``active`` is the number of active probes by block."""
    blocks = sorted(active)
    count = min(shards or len(blocks), len(blocks))
    total = max(sum(active.values()), 1)
    result: list[list[int]] = [[] for _ in range(count)]
    done, at = 0, 0
    for position, block in enumerate(blocks):
        remaining = len(blocks) - position
        middle = (done + active[block] / 2) * count / total
        # on to the next shard when its share begins, or when there are only enough blocks left for one each
        if result[at] and at < count - 1 and (middle >= at + 1 or remaining <= count - 1 - at):
            at += 1
        result[at].append(block)
        done += active[block]
    return result
