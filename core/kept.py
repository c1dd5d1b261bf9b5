# SPDX-License-Identifier: GPL-3.0-or-later
"""Results that are kept while what they were made of stays the same.

A scene is read and baked again and again while its light, its materials and the settings are tuned; most of it is what
it was. What is kept here is asked for with all that it depends on and compared byte by byte, so nobody has to tell when
something has changed, and what comes out never depends on whether something was kept.
"""

from __future__ import annotations

import hashlib
import weakref
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import update_wrapper
from typing import Any, Generic, TypeVar

import numpy as np

Result = TypeVar("Result")

_WEIGHTS = np.random.default_rng(0x5DEECE66D).integers(0, 1 << 64, 4096, np.uint64) | np.uint64(1)
_ROW_BYTES = _WEIGHTS.nbytes
MOST_BYTES = 1 << 27  # of arrays that a result was made of; more is made anew, not held


class Kept(Generic[Result]):
    """The last results of one function that changes nothing it is given, and whose results nobody changes."""

    def __init__(self, make: Callable[..., Result], last: int = 2, most_bytes: int = MOST_BYTES):
        """
        Args:
            last: so many results, two as a bake reads the scene as renders show it and as the viewport does.
            most_bytes: of arrays that a result was made of.
        """
        self._make, self._last, self._most_bytes = make, last, most_bytes
        update_wrapper(self, make)
        self._kept: list[tuple[tuple, Result]] = []  # newest first; replaced, never changed: threads may ask too

    def __call__(self, *inputs: Any) -> Result:
        """``make(*inputs)``, or what that gave when it was last asked with the same."""
        kept = self._kept
        for before, result in kept:
            if same(before, inputs):
                return result
        result = self._make(*inputs)
        if _bytes(inputs) <= self._most_bytes:
            self._kept = [(inputs, result), *kept[: self._last - 1]]
        return result

    def forget(self) -> None:
        """The next result is made in any case."""
        self._kept = []


class OncePerArray(Generic[Result]):
    """A function of one array, or of a view of one, that nobody changes: found once as long as the array lives."""

    def __init__(self, find: Callable[[np.ndarray], Result]):
        self._find = find
        self._found: dict[int, tuple[weakref.ref, dict[tuple, Result]]] = {}  # by array: results by what of it is seen

    def __call__(self, array: np.ndarray) -> Result:
        owner = array if array.base is None else array.base
        if not isinstance(owner, np.ndarray):  # memory of something else, which may be gone unnoticed
            return self._find(array)
        key = id(owner)
        known = self._found.get(key)
        if known is None or known[0]() is not owner:
            known = self._found[key] = weakref.ref(owner, lambda _gone: self._found.pop(key, None)), {}
        view = array.__array_interface__["data"][0], array.shape, array.strides, array.dtype
        if view not in known[1]:
            known[1][view] = self._find(array)
        return known[1][view]


def fingerprint(array: np.ndarray) -> bytes:
    """Tells arrays of one shape apart, of which there may be too many to keep and compare: two that differ have the
    same one by a chance of about 2⁻⁶⁴. Three times as fast as a checksum, as numpy does most of it."""
    data = _as_bytes(array)
    whole = data[: len(data) // _ROW_BYTES * _ROW_BYTES].view(np.uint64).reshape(-1, len(_WEIGHTS))
    digest = hashlib.blake2b((whole @ _WEIGHTS).tobytes(), digest_size=16)
    digest.update(data[whole.nbytes :].tobytes())
    return digest.digest()


def same(one: Any, other: Any) -> bool:
    """Whether two values, with all that they hold in fields, lists and dictionaries, are equal; arrays to the byte."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        if one.dtype != other.dtype or one.shape != other.shape:
            return False
        return np.array_equal(_as_bytes(one), _as_bytes(other))
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(value, other[key]) for key, value in one.items())
    if is_dataclass(one):
        return all(same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one))
    return bool(one == other)


def _as_bytes(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8)


def _bytes(value: Any) -> int:
    """That the arrays in ``value`` take."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, (tuple, list)):
        return sum(map(_bytes, value))
    if isinstance(value, dict):
        return sum(map(_bytes, value.values()))
    if is_dataclass(value):
        return sum(_bytes(getattr(value, field.name)) for field in fields(value))
    return 0
