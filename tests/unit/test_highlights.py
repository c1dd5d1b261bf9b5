# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights in gloss that is sent evenly otherwise: they take from the even part what they give."""

import numpy as np
import pytest
from gridlight.core.faint_gloss import albedo_towards, coupled, couplings, faint_rows, mirrored_at
from gridlight.core.gloss import Gloss
from gridlight.core.highlights import MOST_LOOKS, highlights, sharp

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


@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.1])
def test_beside_the_lobe_is_what_facets_leave_to_the_diffuse_part(cosine):
    """With facets so flat that their lobe is hardly anywhere: (A − S)(1 − F)/(1 − S)/π of all light, from wherever."""
    gloss, albedo, views = Gloss((0.09, 0.09, 0.09), (0.04, 0.04, 0.04), 0.05, fixed=True), 0.3, hemisphere()
    found, _ = beyond(gloss, albedo, views, at(cosine))
    rows = np.repeat(faint_rows([gloss]).astype(float), COUNT, axis=0)
    plain = np.full((COUNT, 3), albedo)
    even = albedo_towards(rows, plain, views[:, 2]) * coupled(couplings(rows, plain), at(cosine)[:, 2]) / np.pi
    mirrored = mirrored_at(rows, plain, views[:, 2])
    away = views @ [-np.sqrt(1 - cosine**2), 0.0, cosine] < 0.7
    expected = (albedo - 0.09) * (1 - mirrored) / (1 - 0.09) / np.pi
    np.testing.assert_allclose((even + found)[away], expected[away], atol=1e-3)


def test_it_is_sharp_where_it_is_narrower_than_what_is_looked_at():
    """Plastic of roughness 0.3 seen from 10 to 5 cm above it: α is 0.09, and at 80° facets turn by 0.05 / cos 80°."""
    up, width, turn = np.array([[0.0, 0.0, 1.0]]), np.array([0.09]), np.array([0.05])

    def is_sharp(view_degrees, light_degrees, turn):
        view, light = np.radians(view_degrees), np.radians(light_degrees)
        towards = np.array([[-np.sin(light), 0.0, np.cos(light)]])
        return bool(sharp(up, np.array([[np.sin(view), 0.0, np.cos(view)]]), towards, width, turn)[0])

    assert is_sharp(80, 80, turn) and is_sharp(75, 80, turn)
    assert not is_sharp(80, 80, 0.1 * turn), "small texels"
    assert not is_sharp(0, 80, turn), "far from the peak"
    assert is_sharp(20, 20, turn) and not is_sharp(20, 20, 0.5 * turn)
    assert MOST_LOOKS > 8
