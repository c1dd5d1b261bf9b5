# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: on which surfaces the light of some emitters falls, and which surfaces stand in its way.

Emitters (lamps, glowing objects) that are linked alike are a group, numbered from 1; the light of group 0 falls on
everything, and everything blocks it. What a surface has to do with all groups is its role; number 0 is that of
surfaces that no group leaves out. Only light that comes straight from an emitter is linked: what bounces on, and what
a probe sees of an emitter itself, is not, as in Cycles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .errors import InputError

MOST_ROLES = 1 << 16  # their numbers share a float32 with other bits of a triangle


@dataclass(frozen=True)
class Links:
    """What a surface has to do with groups of emitters. In masks, bit g − 1 stands for group g."""

    group: int = 0  # to which the surface's own emission belongs
    unlit_by: int = 0  # groups whose light does not fall on it
    passed_by: int = 0  # groups whose light it does not block

    @property
    def groups(self) -> int:
        """The highest group that this knows of."""
        return max(self.group, self.unlit_by.bit_length(), self.passed_by.bit_length())


UNLINKED = Links()


@dataclass(frozen=True)
class LinkRoles:
    """Roles of a list of surfaces. M surfaces, R roles, G groups."""

    of_surface: np.ndarray  # (M,) int
    group: np.ndarray  # (R,) int, of the emission of each role's surfaces
    lit: np.ndarray  # (R, G + 1) bool: the group's light falls on them
    blocks: np.ndarray  # (R, G + 1) bool: they stand in its way

    @property
    def groups(self) -> int:
        return self.lit.shape[1] - 1

    def rows(self) -> np.ndarray:
        """(R·(G + 1), 4) elements of ray_lib's links: whether the light falls on a role, is blocked by it, passes any;
        the first of a role its own group instead."""
        rows = np.zeros((*self.lit.shape, 4), np.float32)
        rows[..., 0], rows[..., 1], rows[..., 2] = self.lit, self.blocks, ~self.blocks.all(axis=0)
        rows[:, 0, 0] = self.group
        return rows.reshape(-1, 4)


def link_roles(links: Sequence[Links]) -> LinkRoles:
    """The roles of surfaces with ``links`` (M,); at least one surface is assumed where there is none.

    Raises:
        InputError: more roles than can be numbered.
    """
    numbers: dict[Links, int] = {UNLINKED: 0}
    of_surface = [numbers.setdefault(one, len(numbers)) for one in links] or [0]
    if len(numbers) > MOST_ROLES:
        raise InputError(
            f"light linking tells {len(numbers)} kinds of objects apart, {MOST_ROLES} is the most; let lights share "
            "their collections"
        )
    roles = list(numbers)
    bits = np.arange(max(role.groups for role in roles))
    lit, blocks = (
        np.array([[True, *(mask >> int(bit) & 1 == 0 for bit in bits)] for mask in masks])
        for masks in ([role.unlit_by for role in roles], [role.passed_by for role in roles])
    )
    return LinkRoles(np.array(of_surface), np.array([role.group for role in roles]), lit, blocks)
