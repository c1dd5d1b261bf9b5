# SPDX-License-Identifier: GPL-3.0-or-later
"""Gloss that is sent in all directions: what facets do on average, and nothing of it gets lost."""

import numpy as np
import pytest
from gridlight.core.faint_gloss import albedo_towards, coupled, couplings, faint_rows
from gridlight.core.gloss import Gloss, GlossyPlaces, gloss_rows
from gridlight.core.sampling import sample_cosine

pytestmark = pytest.mark.any_version
COSINES = (np.arange(4000) + 0.5) / 4000
PLASTIC = Gloss((0.06, 0.06, 0.06), (0.04, 0.04, 0.04), 0.5, fixed=True)
METAL = Gloss((0.9, 0.8, 0.7), (0.9, 0.5, 0.3), 0.7)


def at_cosines(gloss, albedo):
    rows = np.repeat(faint_rows([gloss]), len(COSINES), axis=0)
    albedo = np.tile(np.asarray(albedo, float), (len(COSINES), 1))
    return albedo_towards(rows, albedo, COSINES), coupled(couplings(rows, albedo), COSINES)


@pytest.mark.parametrize(("gloss", "albedo"), [(PLASTIC, (0.1, 0.5, 0.8)), (METAL, (0.5, 0.4, 0.3))])
def test_over_all_directions_it_is_the_albedo(gloss, albedo):
    sent, taken = at_cosines(gloss, albedo)
    np.testing.assert_allclose((2 * COSINES[:, None] * sent).mean(axis=0), albedo, rtol=2e-3)
    np.testing.assert_allclose((2 * COSINES[:, None] * taken).mean(axis=0), 1.0, rtol=1e-5)
    assert (sent > 0).all() and (taken > 0).all()


def test_what_sends_back_everything_does_so_in_every_direction():
    np.testing.assert_allclose(at_cosines(PLASTIC, (1.0, 1.0, 1.0))[0], 1.0, rtol=1e-9)


def test_no_gloss_is_diffuse():
    sent, taken = at_cosines(None, (0.2, 0.3, 0.4))
    np.testing.assert_allclose(sent, np.tile([0.2, 0.3, 0.4], (len(COSINES), 1)))
    np.testing.assert_allclose(taken, 1.0)


@pytest.mark.parametrize("roughness", [0.2, 0.35, 0.5, 0.7])
def test_it_grows_as_facets_mirror(roughness):
    """Black plastic: what leaves after one reflection, over all directions, by what leaves of light face on."""
    random, count, black = np.random.default_rng(1), 400000, np.full((1, 3), 0.06)
    gloss = Gloss((1.0, 1.0, 1.0), (0.04, 0.04, 0.04), roughness)
    up, rows = np.tile([0, 0, 1.0], (count, 1)), np.repeat(gloss_rows([gloss]).astype(float), count, axis=0)
    towards = sample_cosine(up, random.random((count, 2)))

    def sent(cosine):
        view = np.tile([np.sqrt(1 - cosine**2), 0, cosine], (count, 1))
        places = GlossyPlaces(rows, np.repeat(black, count, axis=0), up, up, view)
        return (places.lobe(towards, np.full(count, roughness**2))[:, 0] * np.pi / towards[:, 2]).mean()

    for cosine in (0.15, 0.3, 0.6):
        found, face_on = (albedo_towards(faint_rows([gloss]), black, np.array([c]))[0, 0] for c in (cosine, 1.0))
        assert found / face_on == pytest.approx(sent(cosine) / sent(1.0), rel=0.1)
