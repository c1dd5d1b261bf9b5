# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes Object Info and Attribute tell a material of the object that wears it."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

_UINT_MAX = 0xFFFFFFFF


@dataclass
class InstanceFacts:
    """What the Object Info and Attribute nodes tell of an object."""

    location: tuple[float, float, float] = (0.0, 0.0, 0.0)
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    index: float = 0.0
    random: float = 0.0
    properties: dict[str, tuple[float, ...]] = field(default_factory=dict)


def facts_of(item: bpy.types.Object, instance, properties: frozenset[str]) -> InstanceFacts:
    """Of the evaluated ``item`` at an instance of the depsgraph, with the values of custom ``properties``."""
    found = {}
    for name in properties:
        value = item.get(name, item.data.get(name))
        try:
            found[name] = tuple(float(one) for one in np.atleast_1d(value)) if value is not None else (0.0,)
        except (TypeError, ValueError):  # text, or a datablock
            found[name] = (0.0,)
    return InstanceFacts(
        location=tuple(instance.matrix_world.translation),
        color=tuple(item.color),
        index=float(item.pass_index),
        random=((instance.random_id & _UINT_MAX) or _random_of_name(item.name)) / _UINT_MAX,
        properties=found,
    )


def _random_of_name(name: str) -> int:
    """The random number that Cycles gives an object that is no instance: Jenkins' hash (lookup3) of its name's hash."""
    key = 0
    for byte in name.encode():
        key = (key * 37 + byte) & _UINT_MAX
    a = b = c = (0xDEADBEEF + 8 + 13) & _UINT_MAX
    a = (a + key) & _UINT_MAX
    for which, turn in enumerate((14, 11, 25, 16, 4, 14, 24)):
        if which % 3 == 0:
            c = ((c ^ b) - _rotated(b, turn)) & _UINT_MAX
        elif which % 3 == 1:
            a = ((a ^ c) - _rotated(c, turn)) & _UINT_MAX
        else:
            b = ((b ^ a) - _rotated(a, turn)) & _UINT_MAX
    return c


def _rotated(value: int, bits: int) -> int:
    return ((value << bits) | (value >> (32 - bits))) & _UINT_MAX
