# SPDX-License-Identifier: GPL-3.0-or-later
"""When iterations stop, on series whose limit is known: a bounce adds ``ratio`` of the one before."""

import numpy as np
import pytest
from gridlight.bake.convergence import AUTO_LIMIT, MANY_MODES, Convergence
from gridlight.core.extrapolation import STATES, Sums, reduced_rank
from gridlight.core.patches import PATIENCE, is_slow, tail_squared


def run(operator, source, tolerance=2e-3, bounces=None):
    """Iterates x ← source + operator·x as a bake does, extrapolating when told to. Returns (state, convergence)."""
    watch = Convergence(bounces, tolerance)
    older = old = np.zeros_like(source)
    states, ahead = [], 0
    while not watch.done:
        ahead = ahead or watch.until_decision
        new = source + operator @ old if watch.iterations else source.copy()
        change = new - old
        ahead -= 1
        factor = watch.add(Sums(float(new @ new), float(change @ change), float(change @ (old - older))), not ahead)
        assert not (ahead and factor) and watch.iterations < 2 * AUTO_LIMIT
        states.insert(0, new)
        if factor == MANY_MODES:
            limit = reduced_rank(np.stack(states[:STATES])[..., None])
            new = new if limit is None else limit[:, 0]
        elif factor:
            new = new + factor * change
        states[0] = new
        older, old = old, new
    return old, watch


@pytest.mark.parametrize("ratio,most", [(0.0, 3), (0.1, 6), (0.5, 12), (0.9, 20), (0.99, 60)])
def test_one_mode_converges_to_its_limit(ratio, most):
    state, watch = run(np.array([[ratio]]), np.array([1.0]))
    assert watch.done and watch.converged
    assert state[0] * (1 - ratio) == pytest.approx(1, rel=2e-3)
    assert watch.iterations <= most
    assert "converged" in watch.reason


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5])
def test_what_is_missing_is_below_the_tolerance(tolerance):
    generator = np.random.default_rng(0)
    operator = generator.random((20, 20))
    operator *= 0.8 / np.abs(np.linalg.eigvals(operator)).max()
    source = generator.random(20)
    state, watch = run(operator, source, tolerance)
    limit = np.linalg.solve(np.eye(20) - operator, source)
    assert watch.converged
    assert np.linalg.norm(state - limit) / np.linalg.norm(limit) < 1.5 * tolerance


@pytest.mark.parametrize("ratios", [(0.9, 0.5), (0.95, 0.9), (0.99, 0.3), (0.9, -0.5)])
def test_two_modes(ratios):
    source = np.array([1.0, 1.0])
    state, watch = run(np.diag(ratios), source)
    limit = source / (1 - np.array(ratios))
    assert watch.converged
    assert np.linalg.norm(state - limit) / np.linalg.norm(limit) < 4e-3


def test_a_bright_but_small_mode_that_decays_fast_does_not_fool_it():
    """Direct light is a hundred times what still bounces; the slow mode must still be waited for."""
    source = np.array([100.0, 1.0])
    state, watch = run(np.diag([0.1, 0.98]), source)
    limit = source / (1 - np.array([0.1, 0.98]))
    assert watch.converged
    assert np.linalg.norm(state - limit) / np.linalg.norm(limit) < 4e-3


def test_light_that_is_never_lost_stops_at_the_limit():
    _state, watch = run(np.array([[1.0]]), np.array([1.0]))
    assert watch.done and not watch.converged
    assert watch.iterations == AUTO_LIMIT + 1
    assert "not converged" in watch.reason and "base colour" in watch.reason


def test_light_that_grows_stops_too():
    _state, watch = run(np.array([[1.001]]), np.array([1.0]))
    assert watch.done and not watch.converged


@pytest.mark.parametrize("ratio", [0.0, 0.5, 0.9])
def test_light_that_arrives_with_the_first_bounce(ratio):
    """What glows and the world are brought along by rays: the first iteration is dark, and that is no end."""
    watch = Convergence(None, 2e-3)
    older = old = 0.0
    while not watch.done:
        new = 1.0 + ratio * old if watch.iterations else 0.0
        factor = watch.add(Sums(new * new, (new - old) ** 2, (new - old) * (old - older)))
        older, old = old, new + factor * (new - old)
    assert watch.converged and watch.iterations > 1
    assert old * (1 - ratio) == pytest.approx(1, rel=2e-3)


def test_no_light_at_all():
    state, watch = run(np.array([[0.5]]), np.array([0.0]))
    assert watch.converged and state[0] == 0
    assert watch.iterations <= 3


@pytest.mark.parametrize("bounces", [0, 1, 7])
def test_a_number_of_bounces_is_kept_exactly(bounces):
    state, watch = run(np.array([[0.5]]), np.array([1.0]), bounces=bounces)
    assert watch.iterations == bounces + 1 and watch.done
    assert watch.converged == (bounces == 7 and watch.missing < 2e-3)
    assert state[0] == pytest.approx(sum(0.5**i for i in range(bounces + 1)), rel=1e-12)
    assert f"{bounces} bounces" in watch.reason


def test_many_slow_modes():
    """Closed cupboards: twelve modes, each at its own slow pace, beside a room that settles soon."""
    ratios = np.concatenate([np.linspace(0.95, 0.995, 12), np.full(40, 0.5)])
    source = np.concatenate([np.full(12, 0.02), np.ones(40)])
    state, watch = run(np.diag(ratios), source)
    limit = source / (1 - ratios)
    assert watch.converged and watch.iterations < 300
    assert np.linalg.norm(state - limit) / np.linalg.norm(limit) < 4e-3


def fill_hollow(share, own_light):
    """A room that loses a fifth of its light a bounce, and a hollow of ``share`` of the patches that loses 1/5000 and
    gets as little from the room. Returns (state of the hollow against its limit, convergence)."""
    watch, source, tolerance = Convergence(None, 2e-3), np.array([1.0, own_light]), 2e-3
    operator, weight = np.array([[0.8, 0.0], [2e-4, 1 - 2e-4]]), np.array([1 - share, share])
    states = [np.zeros(2)] * STATES
    while not watch.done:
        new = source + operator @ states[0] if watch.iterations else source.copy()
        change, last = new - states[0], states[0] - states[1]
        slow = is_slow(new[:, None], change[:, None], last[:, None], tolerance)
        whole, of_others = weight, weight * ~slow
        factor = watch.add(
            Sums(
                whole @ new**2,
                whole @ change**2,
                whole @ (change * last),
                weight @ slow,
                of_others @ new**2,
                of_others @ tail_squared(change[:, None], last[:, None]),
            )
        )
        states = [new, *states[: STATES - 1]]
        if factor == MANY_MODES:
            limit = reduced_rank(np.stack(states)[..., None])
            states[0] = new if limit is None else limit[:, 0]
        elif factor:
            states[0] = new + factor * change
    return states[0][1] / np.linalg.solve(np.eye(2) - operator, source)[1], watch


def test_nobody_waits_for_a_minor_hollow():
    filled, watch = fill_hollow(0.05, 0.0)
    assert watch.converged and watch.has_hollows and watch.iterations <= PATIENCE + 2
    assert 0.5 * PATIENCE / 5000 < filled < 2 * PATIENCE / 5000, "as after as many bounces, not as for ever"


@pytest.mark.parametrize("share,own_light", [(0.4, 0.0), (0.05, 1.0)])
def test_what_holds_much_or_is_much_is_waited_for(share, own_light):
    _filled, watch = fill_hollow(share, own_light)
    assert not watch.has_hollows and watch.iterations > 2 * PATIENCE


def test_reduced_rank_is_exact_for_few_modes():
    ratios = np.array([0.98, 0.8, -0.4])
    states = [np.zeros(3)]
    source = np.array([1.0, 2.0, 3.0])
    for _ in range(STATES - 1):
        states.insert(0, source + ratios * states[0])
    found = reduced_rank(np.stack(states)[..., None])
    np.testing.assert_allclose(found[:, 0], source / (1 - ratios), rtol=1e-4)


def test_what_never_settles_is_not_extrapolated():
    states = np.arange(STATES, 0, -1, dtype=float)[:, None, None] * np.ones((1, 4, 1))
    assert reduced_rank(states) is None
    assert reduced_rank(np.ones((STATES, 4, 3))) is None
