# SPDX-License-Identifier: GPL-3.0-or-later
"""Facets and lobes of glossy surfaces, and lamps that rays meet: energy, shapes, closed forms."""

import numpy as np
import pytest
from gridlight.core import direct_light, gloss
from gridlight.core.sampling import sample_cosine, sample_r2
from gridlight.core.snapshot import Light

pytestmark = pytest.mark.any_version
UP = np.array([0.0, 0.0, 1.0])
random = np.random.default_rng(0)


def places(view, roughness, count, share=1.0, facing=1.0, albedo=1.0):
    rows = gloss.gloss_rows([gloss.Gloss((share,) * 3, (facing,) * 3, roughness)]).astype(float)
    flat = [
        np.tile(value, (count, 1)) for value in (np.full(3, albedo), UP, UP, np.asarray(view) / np.linalg.norm(view))
    ]
    return gloss.GlossyPlaces(np.tile(rows, (count, 1, 1)), *flat)


def keys(count):
    return random.integers(0, 2**32, (count, 3), dtype=np.uint64).astype(np.uint32)


@pytest.mark.parametrize("roughness", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("view", [(0.0, 0, 1), (0.7, 0, 0.7), (0.95, 0, 0.3)])
def test_a_lobe_is_what_directions_are_drawn_from(roughness, view):
    """Its integral is one, up to the fit of what leaves after one reflection, and its mean direction theirs."""
    count = 40000
    drawn = places(view, roughness, count).reflect(keys(count), random.random((count, 2)))
    assert (drawn.mirrored == 1).all() and (drawn.diffuse == 0).all()
    np.testing.assert_allclose(np.linalg.norm(drawn.direction, axis=1), 1.0)
    towards = sample_cosine(np.tile(UP, (count, 1)), random.random((count, 2)))
    lobe = places(view, roughness, count).lobe(towards, np.full(count, roughness**2))[:, 0] * np.pi / towards[:, 2]
    assert lobe.mean() == pytest.approx(1.0, abs=0.16)
    mean = (lobe[:, None] * towards).mean(axis=0) / lobe.mean()
    np.testing.assert_allclose(mean, drawn.direction.mean(axis=0), atol=0.03)


def test_a_mirror_mirrors():
    view = np.array([0.6, 0.0, 0.8])
    drawn = places(view, 0.0, 8).reflect(keys(8), random.random((8, 2)))
    np.testing.assert_allclose(drawn.direction, np.tile([-0.6, 0, 0.8], (8, 1)), atol=1e-12)


def test_facets_of_dielectrics_reflect_by_fresnel():
    """By Snell's law for both polarisations, and nothing of that face on, all of it along the surface."""
    angle = np.radians([0.0, 20, 45, 56.31, 70, 80, 89.999])
    cosine, bent = np.cos(angle), np.sqrt(1 - (np.sin(angle) / 1.5) ** 2)
    across = (cosine - 1.5 * bent) / (cosine + 1.5 * bent)
    along = (1.5 * cosine - bent) / (1.5 * cosine + bent)
    reflected = 0.04 + 0.96 * gloss.dielectric_growth(cosine)
    np.testing.assert_allclose(reflected, (across**2 + along**2) / 2, atol=1e-12)
    plastic = places(UP, 0.0, len(angle), share=0.09, facing=0.04).mirrored(cosine)[:, 0]
    np.testing.assert_allclose(plastic / plastic[0], reflected / 0.04, rtol=1e-6)
    metal = places(UP, 0.0, len(angle), share=0.5, facing=0.5).mirrored(cosine)[:, 0]
    np.testing.assert_allclose(metal / metal[0], 1 + (1 - cosine) ** 5, rtol=1e-6)


@pytest.mark.parametrize(("facing", "share"), [(0.04, 0.09), (0.5, 0.8), (1.0, 0.3)])
@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.6])
def test_what_is_mirrored_is_the_share_over_all_directions(roughness, facing, share):
    """And what is not is diffuse: of a surface that sends back everything nothing is lost."""
    count = 20000
    views = sample_cosine(np.tile(UP, (count, 1)), random.random((count, 2)))
    surface = places(UP, roughness, count, share, facing)
    surface.view = views
    drawn = surface.reflect(keys(count), random.random((count, 2)))
    assert drawn.mirrored.mean() == pytest.approx(share, rel=0.03)
    np.testing.assert_allclose(drawn.mirrored + drawn.diffuse, 1.0, rtol=1e-12)


def frame(position, towards):
    back = -np.asarray(towards, float) / np.linalg.norm(towards)
    right = np.cross([0.3, 0.5, 0.8], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = position
    return matrix


COLOUR, PLACE = (3.0, 2.0, 1.0), frame((0.3, 0.2, 1.5), (-0.1, 0.1, -1))
LAMPS = {
    "soft": Light("soft", "POINT", COLOUR, PLACE, radius=0.4),
    "sphere": Light("sphere", "POINT", COLOUR, PLACE, radius=0.4, soft_falloff=False),
    "spot": Light("spot", "SPOT", COLOUR, PLACE, radius=0.5, spot_size=0.8, spot_blend=0.5),
    "sun": Light("sun", "SUN", COLOUR, PLACE, angle=0.8),
    "rectangle": Light("rectangle", "AREA", COLOUR, PLACE, size_x=1.2, size_y=0.7),
    "ellipse": Light("ellipse", "AREA", COLOUR, PLACE, shape="ELLIPSE", size_x=1.2, size_y=0.7),
    "spread": Light("spread", "AREA", COLOUR, PLACE, size_x=1.2, size_y=0.7, spread=1.5),
}


@pytest.mark.parametrize("name", LAMPS)
def test_rays_meet_lamps_where_points_on_them_lie(name):
    """Both ways to the irradiance of one place agree."""
    lamp, count = LAMPS[name], 200000
    origin, u = np.zeros((count, 3)), sample_r2(np.zeros((count, 3), np.uint32), np.arange(count)).astype(float)
    sample = direct_light.sample_light(lamp, origin, u)
    by_points = (sample.irradiance * np.maximum(sample.directions[:, 2:], 0)).mean(axis=0)
    directions = sample_cosine(np.tile(UP, (count, 1)), u)
    by_rays = direct_light.met(lamp, origin, directions, np.full(count, np.inf)).mean(axis=0) * np.pi
    np.testing.assert_allclose(by_rays, by_points, rtol=0.02)
    assert not direct_light.met(lamp, origin, directions, np.full(count, 0.5)).any(), "something stands before it"
    extent = direct_light.extent(lamp, origin[:1])[0]
    met = direct_light.met(lamp, origin, directions, np.full(count, np.inf)).any(axis=1)
    assert 0.5 < (met / np.maximum(directions[:, 2], 1e-9) * np.pi).mean() / extent < 1.1
