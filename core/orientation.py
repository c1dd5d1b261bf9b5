# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects' back faces are not the inside of a solid.

A room made from a cube primitive is seen from behind by every probe in it, and so is a solid by the probes that are
stuck inside; only the latter are invalid. What tells them apart is light: it is dark inside a solid, and no window
shows the world. Objects whose back faces are seen lit, or by probes that also see background, are shells: single
walls, rooms with their normals the wrong way round.
"""

from __future__ import annotations

import numpy as np

_LIT_SHARE = 0.02  # of the back faces seen: a spot lights little of a room, less than this is a leak of light
MOST_BEHIND = 0.5  # of the sphere: probes that see more back faces than that do not stand in a room
_MOST_PAIRS = 1 << 22  # of probes and objects that are counted without sorting
_FRONT_SHARE = 0.02  # of a probe's directions: less is no surface that anybody beside the probe could light
_OPEN_SHARE = 0.01  # of a probe's directions that see background: the inside of a solid sees none


def inside_solid(shares: np.ndarray, light_elsewhere: bool = False) -> np.ndarray:
    """(S,) bool of probes that are invalid, from shares (S, 4) of the sphere: back faces of solids, background, lit,
    all back faces.

    Most of what such a probe sees are back faces of solids; or back faces of anything, and neither light nor the
    world, which others do see, among these probes or elsewhere: where it is dark everywhere that tells nothing. Behind
    walls, in the void around a room under a black world, it is the same: back faces, background, and nothing that
    light from there would fall on.
    """
    solid, background, lit, behind = shares.T
    dark = (lit == 0) & (lit.any() or light_elsewhere)
    void = (behind > 0) & (1 - background - behind < _FRONT_SHARE)
    return (solid > MOST_BEHIND) | (dark & (void | ((behind > MOST_BEHIND) & (background == 0))))


class ShellVote:
    """Collects what probes see of objects' back faces, batch by batch and block by block.

    ``behind`` and ``lit`` (object_count,) count sightings of back faces, all and lit ones; ``any_light``: something
    lit, or the world, was seen; ``sees_light``: a probe of a block saw light, set by whoever knows its shares.
    """

    def __init__(self, object_count: int):
        self.behind = np.zeros(object_count)
        self.lit = np.zeros(object_count)
        self.any_light = False
        self.sees_light = False

    def merge(self, other: ShellVote) -> None:
        """Adds the sightings of ``other``. Counts are whole numbers: the order does not matter."""
        self.behind += other.behind
        self.lit += other.lit
        self.any_light |= other.any_light
        self.sees_light |= other.sees_light

    def add(self, sightings: np.ndarray) -> None:
        """``sightings`` (P, S): per probe ±(object + 1) of S directions, negative from behind, half a unit farther
        from zero where lit; 0 background."""
        self.any_light |= bool((sightings == 0).any() or (sightings % 1 != 0).any())
        sightings = sightings[(sightings < 0).any(axis=1)]  # the others have nothing to say
        size = np.abs(sightings)
        seen = sightings != 0
        item = np.floor(size).astype(np.int64) - 1
        open_ = (~seen).mean(axis=1) >= _OPEN_SHARE
        lit = (size > item + 1.25) | open_[:, None]
        probe = np.broadcast_to(np.arange(len(sightings))[:, None], sightings.shape)
        # A probe in front of an object may hit the far side of an edge; only those that see mostly back faces count.
        pair = probe[seen] * len(self.behind) + item[seen]
        if len(sightings) * len(self.behind) > _MOST_PAIRS:
            pair = np.unique(pair, return_inverse=True)[1]
        mostly_behind = np.bincount(pair, np.sign(sightings[seen]))[pair] < 0
        from_behind = mostly_behind & (sightings[seen] < 0)
        item, lit = item[seen][from_behind], lit[seen][from_behind]
        self.behind += np.bincount(item, minlength=len(self.behind))
        self.lit += np.bincount(item[lit], minlength=len(self.lit))

    def shells(self) -> np.ndarray:
        """(object_count,) bool. In the dark nothing tells a room from a solid: all count as shells."""
        if not self.any_light:
            return np.ones(len(self.lit), bool)
        return (self.lit > 0) & (self.lit >= _LIT_SHARE * self.behind)
