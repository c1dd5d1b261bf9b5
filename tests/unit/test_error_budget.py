# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels chosen for a target, against errors that are known by formula."""

import numpy as np
import pytest
from gridlight.cli import arguments, bake
from gridlight.core.error_budget import ErrorGoal, ErrorModel, Level, first_level, next_level, worst_probes
from gridlight.core.errors import InputError


def error_of(level, texels, noise, rest=0.0):
    return texels / level.face**3 + noise / level.samples + rest


@pytest.mark.parametrize("target", [0.0, -0.1, 1.5, float("nan")])
def test_targets_out_of_range_are_refused(target):
    with pytest.raises(InputError, match="--error"):
        ErrorGoal(target)


@pytest.mark.parametrize("texels, noise, rest", [(0.6, 0.0004, 0.0), (3.0, 1e-6, 0.0), (1e-3, 0.002, 1e-5)])
def test_the_model_finds_the_parts_of_errors_that_follow_it(texels, noise, rest):
    model = ErrorModel()
    for level in (Level(8, 1), Level(16, 1), Level(16, 4), Level(32, 2)):
        model.set(level, error_of(level, texels, noise, rest))
    unseen = Level(24, 8)
    np.testing.assert_allclose(model.predicted(unseen), error_of(unseen, texels, noise, rest), rtol=1e-6)
    np.testing.assert_allclose(model.parts(unseen)[0], texels / 24**3, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("texels, noise", [(1.5, 2.5e-4), (0.9, 1.5e-4), (0.6, 4e-5), (0.4, 0.0015)])
@pytest.mark.parametrize("target", [0.03, 0.015, 0.008])
def test_what_is_chosen_step_by_step_meets_the_target_for_little_more_than_the_best(texels, noise, target):
    goal, probes = ErrorGoal(target), 200
    level = first_level(goal, 16, 1)
    model, spent = ErrorModel(), level.cost(probes)
    for _ in range(8):
        error = error_of(level, texels, noise)
        if error <= target**2:
            break
        model.set(level, error)
        before, level = level, next_level(model, level, target**2, frozenset(), probes, 3 * spent)
        paid = level.samples - before.samples if level.face == before.face else level.samples
        spent += Level(level.face, paid).cost(probes)
    assert error_of(level, texels, noise) <= target**2
    every = [Level(face, samples) for face in (6, 8, 12, 16, 24, 32, 48, 64) for samples in range(1, 65)]
    best = min(one.cost(probes) for one in every if error_of(one, texels, noise) <= target**2)
    assert spent <= 3 * best


def test_what_the_user_keeps_is_kept():
    goal = ErrorGoal(0.001, frozenset({"face"}))
    level = first_level(goal, 10, 1)
    model = ErrorModel()
    model.set(level, 1e-3)
    found = next_level(model, level, 1e-6, goal.kept, 100, 1e9)
    assert level == Level(10, 1) and found.face == 10 and found.samples > 1
    assert next_level(model, level, 1e-6, frozenset({"face", "samples"}), 100, 1e9) is None


def test_nothing_is_tried_that_does_not_help():
    model = ErrorModel()
    for level in (Level(8, 1), Level(16, 1), Level(16, 4)):
        model.set(level, 1e-4)  # neither texels nor noise
    assert next_level(model, Level(16, 4), 1e-6, frozenset(), 100, 1e9) is None


def test_the_worst_probes_are_the_fewest_that_do():
    squared = np.array([1.0, 100.0, 2.0, 50.0, 1.0, 1.0, 1.0, 1.0])
    chosen = worst_probes(squared, 0.0, 2.0)
    assert chosen.tolist() == [False, True, False, True, False, False, False, False]
    assert worst_probes(squared, 0.5, 1.0).all()


def test_options_that_are_given_are_kept():
    parser = arguments.Parser()
    bake.add_arguments(parser, in_blender=False)

    def read(*options):
        return parser.parse_args(arguments.join_signed_values(["room.blend", "-o", "out", *options]))

    args = read("--face", "8", "--error", "0.02", "--bounces", "3")
    assert bake.goal_from(args) == ErrorGoal(0.02, frozenset({"face", "bounces"}))
    assert bake.settings_from(args).face == 8
    assert bake.goal_from(read("--face", "8")) is None and bake.goal_from(read("--error", "0.1")).kept == frozenset()
    with pytest.raises(InputError, match="--error is -0.02"):
        bake.goal_from(read("--error", "-0.02"))
