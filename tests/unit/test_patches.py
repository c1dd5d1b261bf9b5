# SPDX-License-Identifier: GPL-3.0-or-later
"""Which hits share a patch: cells, facings, walls between, sizes by distance, and that numbering is always the same."""

import numpy as np
import pytest
from gridlight.core import patches
from gridlight.core.cubemap import octahedral_encode, pack_normal
from gridlight.core.grid import Grid
from gridlight.core.patches import ANGLE, NO_PATCH, NOTHING, POINTS, SAMPLES, VARIANTS, Patches, caught

GRID = Grid.from_bounds([-4] * 3, [4] * 3, (5, 5, 5))  # cells of 2 m; patches of 43 cm, a 32nd of the diagonal
CELL = 8 * np.sqrt(3) / 32
UP = (0.0, 0.0, 1.0)


def hits_at(positions, normal=UP):
    positions = np.asarray(positions, float)
    normal = np.broadcast_to(np.asarray(normal, float) / np.linalg.norm(normal), positions.shape)
    packed = pack_normal(octahedral_encode(normal))
    return np.column_stack([positions, packed]).astype(np.float32)


def everything(items, numbers):
    """No wall anywhere."""
    return np.ones(len(items), bool)


def far(hits):
    """View distances at which cells are of the plain size."""
    return np.full(len(hits), 100.0, np.float32)


def floor(count=2000, seed=0, size=3.9):
    places = np.random.default_rng(seed).uniform(-size, size, (count, 3))
    places[:, 2] = -1.0
    return hits_at(places)


def test_patches_are_cells():
    """Hits share a patch exactly where they share a cell: no two farther apart than its edge, and all cells differ."""
    hits, found = floor(), Patches(GRID)
    assert found.cell == pytest.approx(CELL)
    patch = found.bind(hits, far(hits), everything)
    cell = np.floor(hits[:, :2] / CELL + 0.37).astype(int)
    _, expected = np.unique(cell, axis=0, return_inverse=True)
    pairs = np.unique(np.stack([patch, expected.ravel()]), axis=1)
    assert pairs.shape[1] == found.count == expected.max() + 1
    assert found.seen.all()


def test_what_faces_elsewhere_is_another_patch():
    found = Patches(GRID)
    directions = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1), (1, 1, 0), (1, -1, 1)]
    hits = np.concatenate([hits_at([[0.02, 0.02, 0.02]], normal) for normal in directions])
    assert len(set(found.bind(hits, far(hits), everything))) == len(directions)
    nearly = hits_at([[0.02, 0.02, 0.02]], (0.2, -0.1, 1))
    assert (
        found.bind(nearly, far(nearly), everything)[0] == found.bind(hits_at([[0.02] * 3]), far(nearly), everything)[0]
    )


def test_a_negative_normal_is_no_hit():
    hits, found = floor(100), Patches(GRID)
    hits[::2, 3] = -1.0
    patch = found.bind(hits, far(hits), everything)
    assert (patch[::2] == NO_PATCH).all() and (patch[1::2] >= 0).all()
    assert Patches(GRID).bind(hits[::2], far(hits[::2]), everything).max() == NO_PATCH
    assert Patches(GRID).bind(hits[:0], far(hits[:0]), everything).size == 0


def test_a_wall_cuts_a_cell_in_two():
    """Hits left of x = 0 do not see those right of it."""
    hits, found = floor(), Patches(GRID)

    def sees(items, numbers):
        return np.sign(hits[items, 0]) == np.sign(found.points[numbers, 0, 0])

    patch = found.bind(hits, far(hits), sees)
    for number in range(found.count):
        assert len(set(np.sign(hits[patch == number, 0]))) == 1
    by_cells = Patches(GRID)
    by_cells.bind(hits, far(hits), everything)
    assert found.count > by_cells.count
    again = found.bind(hits, far(hits), sees)
    np.testing.assert_array_equal(patch, again)


def test_hits_that_see_no_leader_of_their_cell():
    """Nobody sees anybody: one patch a variant, the last of which shows its light on texels beyond, but lies where its
    leader does; rays beyond end on none."""
    hits, nobody = hits_at(np.linspace([0.01, 0.01, 0], [0.1, 0.1, 0], 10)), lambda items, _: np.zeros(len(items), bool)
    found = Patches(GRID)
    patch = found.bind(hits, far(hits), nobody)
    np.testing.assert_array_equal(np.bincount(patch), [1] * (VARIANTS - 1) + [11 - VARIANTS])
    np.testing.assert_array_equal(found.points, np.repeat(hits[:VARIANTS, None], POINTS, axis=1))
    ends = Patches(GRID).bind(hits, None, nobody)
    np.testing.assert_array_equal(ends, [*range(VARIANTS), *[NO_PATCH] * (10 - VARIANTS)])


def test_rays_that_only_a_handful_of_patches_exchange_are_caught():
    ends = np.full((16, 8), NOTHING)
    ends[0], ends[1] = 1, 0  # a slit
    ends[2], ends[3] = 3, [2] * 7 + [0]  # one finds the way out, if only to another slit
    ends[4], ends[5], ends[6] = 5, [4] * 4 + [6] * 4, [NO_PATCH] * 4 + [5] * 4
    ends[7], ends[8] = 8, [7] * 7 + [NOTHING]
    for i in range(5):
        ends[9 + i] = 9 + (i + 1) % 5  # a ring of five: more than a handful
    ends[14], ends[15] = 15, [2] + [14] * 7  # the first ray of others is not looked at, but one's own is
    np.testing.assert_array_equal(np.flatnonzero(caught(ends)), [0, 1, 2, 3, 4, 5, 6, 14])


def test_every_hit_is_asked_about_its_leader_once():
    hits, found, asked = floor(300), Patches(GRID), []

    def sees(items, numbers):
        asked.extend(items)
        return np.ones(len(items), bool)

    patch = found.bind(hits, far(hits), sees)
    leaders = [np.flatnonzero(patch == number)[0] for number in range(found.count)]
    assert sorted(asked) == sorted(set(range(len(hits))) - set(leaders))
    np.testing.assert_array_equal(found.points[:, 0], hits[leaders])


def test_a_surface_close_by_gets_small_patches():
    """As the probe sees it, a patch is never wider than ANGLE, and more than half of that while cells are smaller than
    plain ones."""
    for distance in (0.05, 0.2, 0.7):
        hits, found = floor(4000, size=0.3), Patches(GRID)
        patch = found.bind(hits, np.full(len(hits), distance, np.float32), everything)
        widths = [np.ptp(hits[patch == n, :2], axis=0).max() for n in np.unique(patch)]
        assert max(widths) <= min(ANGLE * distance, CELL) and max(widths) > 0.4 * min(ANGLE * distance, CELL)


def test_patches_grow_with_the_distance_from_the_volume():
    places = np.random.default_rng(3).uniform(-1, 1, (6000, 3))
    widths = []
    for distance in (0.0, 40.0, 400.0):
        hits = hits_at(places * [0.4 * distance + 2, 1, 1] + [4 + distance, 0, 0])
        found = Patches(GRID)
        patch = found.bind(hits, far(hits) * 1000, everything)
        sizes = np.bincount(patch)
        widths.append(max(np.ptp(hits[patch == n, 0]) for n in np.argsort(sizes)[-3:]))
    assert widths[0] <= 1.01 * CELL and widths[1] > 3 * CELL and widths[2] > 5 * widths[1]


def test_rays_end_on_plain_cells():
    hits, found = floor(500, size=1), Patches(GRID)
    by_texels = found.bind(hits, np.full(500, 0.3, np.float32), everything)
    seen = found.count
    by_rays = found.bind(hits, None, everything)
    assert by_rays.min() >= seen and len(set(by_rays)) < len(set(by_texels))
    assert found.seen[:seen].all() and not found.seen[seen:].any()


def test_without_founding_unknown_cells_stay_unbound():
    hits, found = floor(), Patches(GRID)
    left = hits[hits[:, 0] < 0]
    patch = found.bind(left, far(left), everything)
    before = found.count
    again = found.bind(hits, far(hits), everything, found=False)
    assert found.count == before
    np.testing.assert_array_equal(again[hits[:, 0] < 0], patch)
    assert (again[hits[:, 0] > CELL] == NO_PATCH).all()


def test_ends_of_rays():
    """The first round founds plain patches, later ones coarser patches for what is new, the last none."""
    hits, found = floor(), Patches(GRID)
    hits[::7, 3] = -1.0
    left = np.where(hits[:, :1] < 0, hits, np.float32(-1))
    first = found.bind_ends(left, 0, everything)
    np.testing.assert_array_equal(first == NOTHING, left[:, 3] < 0)
    plain = found.count
    second = found.bind_ends(hits, 1, everything)
    np.testing.assert_array_equal(second[first >= 0], first[first >= 0])
    assert (second[hits[:, 3] >= 0] >= 0).all() and (second[hits[:, 3] < 0] == NOTHING).all()
    assert 0 < found.count - plain < 0.5 * plain, "twice as wide: about a quarter as many"
    fresh = Patches(GRID)
    last = fresh.bind_ends(hits, patches.MOST_ROUNDS - 1, everything)
    assert fresh.count == 0 and (last[hits[:, 3] >= 0] == NO_PATCH).all()


def test_points_are_spread_over_the_hits():
    """Neighbours in a 4×4 block never compete; who wins shares the points evenly, the leader among them."""
    side = np.arange(-3.5, 3.5, 0.11)
    places = np.stack([*np.meshgrid(side, side, indexing="xy"), np.full((len(side),) * 2, -1.0)], axis=-1)
    hits, found = hits_at(places.reshape(-1, 3)), Patches(GRID)  # 64 in a row, four of them across a cell
    patch = found.bind(hits, far(hits), everything, row_length=len(side))
    assert found.points.shape == (found.count, POINTS, 4)
    sizes = []
    for number in range(found.count):
        mine = hits[patch == number]
        chosen, times = np.unique(found.points[number], axis=0, return_counts=True)
        assert (chosen[:, None] == mine).all(axis=2).any(axis=1).all(), "points are hits of the patch"
        assert (found.points[number, 0] == mine[0]).all(), "the leader comes first"
        assert times.max() - times.min() <= 1
        assert len(chosen) >= min(len(mine), POINTS) - 1, "the leader leaves its own place empty"
        sizes.append(len(mine))
    assert min(sizes) < POINTS <= max(sizes)
    before = found.points.copy()
    found.bind(floor(500, seed=9), far(floor(500)), everything)
    np.testing.assert_array_equal(found.points[: len(before)], before)


def test_two_runs_number_alike():
    runs = []
    for _ in range(2):
        found = Patches(GRID)
        ids = [found.bind(floor(1000, seed), far(floor(1000)), everything) for seed in range(3)]
        runs.append((np.concatenate(ids).tobytes(), found.points.tobytes()))
    assert runs[0] == runs[1]


def test_few_patches_get_more_effort():
    counts = 40_000, 20_000, 9_000, 5_000, 1, 0
    assert [patches.effort(count, 1, 16) for count in counts] == [1, 2, 8, 16, 16, 16]
    assert [patches.effort(count, 1, 8) for count in counts] == [1, 1, 4, 8, 16, 16], "coarse texels err more"
    assert patches.effort(40_000, 4, 32) == 4 and patches.effort(1, 4096, 16) == 256


def test_samples_grow_with_the_error_that_one_leaves():
    first, second, third = patches.ERRORS
    deviation = np.array([0.0, 0.9 * first, 1.1 * first, 0.9 * second, 1.1 * second, 0.9 * third, 1.1 * third])
    none, ones = np.zeros(7), np.ones(7)
    expected = [0, 0, 1, 1, 2, 2, 3]
    np.testing.assert_array_equal(patches.direct_samples(none, deviation, ones, 1.0), expected)
    np.testing.assert_array_equal(patches.direct_samples(none, 5 * deviation, 5 * ones, 5.0), expected)
    assert (patches.direct_samples(none, none, none, 0.0) == 0).all()
    # light that a shadow may take away is an error even where it is even: half of it at most
    shadowed = 2 * deviation
    np.testing.assert_array_equal(patches.direct_samples(shadowed, none, ones, 1.0), expected)
    # held against the patch's own light, within bounds
    for light, against in ((0.5, 0.5), (1e-6, 0.1), (20.0, 1.0)):
        np.testing.assert_array_equal(patches.direct_samples(none, against * deviation, light * ones, 1.0), expected)
    assert len(SAMPLES) == len(patches.ERRORS) + 1 and all(np.diff(SAMPLES) > 0)


def test_gather_rays_come_in_fours():
    assert [patches.gather_rays(samples) for samples in (1, 4, 5, 64)] == [4, 4, 8, 64]


def test_parts_of_the_light():
    assert patches.light_parts(3, False) == [(0, 1), (1, 2), (2, 3)]
    assert patches.light_parts(0, True) == [patches.EMITTERS]
    many = patches.light_parts(100, False)
    assert len(many) <= patches.MOST_PARTS and many[0][0] == 0 and many[-1][1] == 100
    assert all(one[1] == other[0] for one, other in zip(many, many[1:]))
