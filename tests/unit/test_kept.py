# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept comes out again for equal things only, and goes when nobody has it any more."""

import gc
from dataclasses import dataclass

import numpy as np
import pytest
from gridlight.core.kept import Kept, OncePerArray, fingerprint, same


@dataclass(frozen=True)
class Thing:
    name: str
    values: np.ndarray


class Counting:
    def __init__(self, function):
        self.calls = 0
        self._function = function

    def __call__(self, *inputs):
        self.calls += 1
        return self._function(*inputs)


ARRAY = np.arange(12.0).reshape(4, 3)
CHANGED = ARRAY + (np.arange(12).reshape(4, 3) == 7) * 1e-15  # the least that this number can change by


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (ARRAY, CHANGED),
        (ARRAY, ARRAY.astype(np.float32)),
        (ARRAY, ARRAY.reshape(3, 4)),
        (np.zeros(2), -np.zeros(2)),
        ([1, ARRAY], [1, CHANGED]),
        ([1, 2], [1, 2, 3]),
        ({"a": ARRAY}, {"a": CHANGED}),
        ({"a": 1}, {"b": 1}),
        (Thing("x", ARRAY), Thing("x", CHANGED)),
        (Thing("x", ARRAY), Thing("y", ARRAY)),
        (1, 1.0),
        (None, 0),
    ],
)
def test_what_differs(one, other):
    assert not same(one, other) and not same(other, one)
    assert same(one, one)


def test_what_is_the_same():
    nan = np.array([np.nan, 1.0])
    assert same([Thing("x", ARRAY), {"k": (nan, None)}], [Thing("x", ARRAY.copy()), {"k": (nan.copy(), None)}])
    assert same(np.zeros((0, 3)), np.zeros((0, 3)))
    assert same(ARRAY[:, ::2], ARRAY[:, ::2].copy()), "views count by what they hold"


def test_results_are_made_once_for_equal_inputs_and_the_last_two_are_kept():
    double = Counting(lambda thing, factor: thing.values * factor)
    kept = Kept(double)
    first = kept(Thing("x", ARRAY), 2)
    assert kept(Thing("x", ARRAY.copy()), 2) is first
    np.testing.assert_array_equal(kept(Thing("x", CHANGED), 2), CHANGED * 2)
    assert kept(Thing("x", ARRAY), 2) is first
    assert double.calls == 2
    kept(Thing("x", ARRAY), 3)
    kept(Thing("x", ARRAY), 4)
    assert kept(Thing("x", ARRAY), 2) is not first
    kept.forget()
    kept(Thing("x", ARRAY), 2)
    assert double.calls == 6


def test_large_things_are_not_held():
    make = Counting(lambda array: array + 1)
    kept = Kept(make, most_bytes=ARRAY.nbytes - 1)
    assert kept(ARRAY) is not kept(ARRAY)
    assert make.calls == 2


def test_once_per_array_and_view_as_long_as_it_lives():
    mean = Counting(lambda array: float(array.mean()))
    found = OncePerArray(mean)
    pixels = np.random.default_rng(1).random((8, 8, 4))
    assert found(pixels[..., :3]) == found(pixels[..., :3]) == pixels[..., :3].mean()
    assert found(pixels[..., 3:]) == pixels[..., 3:].mean()
    assert found(pixels) == pixels.mean()
    assert mean.calls == 3
    del pixels
    gc.collect()
    assert not found._found, "nothing of arrays that are gone is left"
    for value in range(20):  # where one array was, the next one often lies
        assert found(np.full((8, 8, 4), float(value))) == value


@pytest.mark.parametrize("shape", [(5,), (64, 96, 4), (3, 128, 128, 4), (0, 4)])
def test_fingerprints_tell_of_every_element(shape):
    values = np.random.default_rng(8).random(shape).astype(np.float32)
    known = {fingerprint(values)}
    assert fingerprint(values.copy()) in known
    for place in np.linspace(0, values.size - 1, 40).astype(int) if values.size else []:
        changed = values.copy()
        changed.flat[place] = np.nextafter(changed.flat[place], np.float32(2))
        assert fingerprint(changed) not in known
    if values.size:
        assert fingerprint(np.roll(values, 1)) not in known


def test_fingerprints_tell_of_the_order_of_rows():
    rows = np.random.default_rng(9).random((6, 8192)).astype(np.float32)  # each as long as what is weighed together
    assert (
        len({fingerprint(rows[order]) for order in ([0, 1, 2, 3, 4, 5], [1, 0, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0])}) == 3
    )
