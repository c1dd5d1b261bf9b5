# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights in gloss that is sent evenly otherwise: they take from the even part what they give."""

import numpy as np
import pytest
from gridlight.core.faint_gloss import coupled, couplings, faint_rows, mirrored_at
from gridlight.core.gloss import Gloss
from gridlight.core.highlights import highlights

pytestmark = pytest.mark.any_version
PLASTIC = Gloss((0.056, 0.056, 0.056), (0.04, 0.04, 0.04), 0.5, fixed=True)
SATIN = Gloss((0.3, 0.3, 0.3), (0.5, 0.5, 0.5), 0.7)
COUNT = 40000


def hemisphere():
    """(COUNT, 3) directions spread by the cosine over the upper half of the sphere: their mean times π is an
    integral."""
    index = np.arange(COUNT) + 0.5
    height, angle = np.sqrt(1 - index / COUNT), index * np.pi * (3 - 5**0.5)
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)


def at(cosine):
    return np.tile([np.sqrt(1 - cosine**2), 0.0, cosine], (COUNT, 1))


def beyond(gloss, albedo, view, towards):
    """Radiance for each unit of irradiance that is not weighted, beyond the even one, and F of the light."""
    rows = np.repeat(faint_rows([gloss]).astype(float), COUNT, axis=0)
    albedo, up = np.full((COUNT, 3), albedo), np.tile([0.0, 0.0, 1.0], (COUNT, 1))
    width = np.full(COUNT, gloss.roughness**2)
    weight = coupled(couplings(rows, albedo), towards[:, 2])
    return weight * highlights(rows, albedo, up, view, towards, width), mirrored_at(rows, albedo, towards[:, 2])


@pytest.mark.parametrize("gloss", [PLASTIC, SATIN])
@pytest.mark.parametrize("cosine", [1.0, 0.8, 0.5, 0.25])
def test_no_light_is_lost_or_made(gloss, cosine):
    """Of light from one direction, over all views; and to one view, of light from everywhere."""
    found, mirrored = beyond(gloss, 0.3, hemisphere(), at(cosine))
    assert abs(np.pi * found.mean()) < 0.15 * mirrored.mean()
    assert np.pi * np.abs(found).mean() > (0.3 if gloss is PLASTIC else 0.1) * mirrored.mean(), "it moves light"
    arriving, _ = beyond(gloss, 0.3, at(cosine), hemisphere())
    assert abs(np.pi * arriving.mean()) < 0.15 * mirrored.mean()


def test_it_is_brightest_where_a_mirror_would_send_it():
    directions, cosine = hemisphere(), 0.8
    found, _ = beyond(PLASTIC, 0.3, directions, at(cosine))
    brightest = directions[found[:, 0].argmax()]
    assert brightest @ [-np.sqrt(1 - cosine**2), 0.0, cosine] > np.cos(0.15)
    assert found[:, 0].min() < 0, "elsewhere less than evenly"


def test_light_from_below_makes_none():
    towards = at(0.5) * [1, 1, -1]
    assert not beyond(PLASTIC, 0.3, hemisphere(), towards)[0].any()
