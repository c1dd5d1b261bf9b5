# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light against closed forms, kind by kind. The surface is the plane z = 0 with its normal up unless said
otherwise."""

import numpy as np
import pytest
from gridlight.core import direct_light
from gridlight.core.light_profiles import DISTANCES_M, HEIGHT, WIDTH, LightProfile
from gridlight.core.panorama import panorama_directions
from gridlight.core.sampling import sample_r2
from gridlight.core.snapshot import Light

COLOR = np.array([2.0, 3.0, 5.0])
SAMPLES = 4096


def facing(position, direction=(0, 0, -1)):
    """(4, 4) matrix of a light at ``position`` that shines along ``direction``."""
    back = -np.asarray(direction, float) / np.linalg.norm(direction)
    right, up = direct_light.tangent_frame(back[None])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right[0], up[0], back], axis=1)
    matrix[:3, 3] = position
    return matrix


def light(kind, position=(0, 0, 2), direction=(0, 0, -1), **options):
    return Light("light", kind, tuple(COLOR), facing(position, direction), **options)


def irradiance(lamp, point=(0.0, 0, 0), normal=(0.0, 0, 1), samples=SAMPLES, visible=None):
    everything = visible or (lambda origins, directions, limits: np.ones(len(origins), bool))
    point, normal = np.array([point], float), np.array([normal], float)
    numbers = np.concatenate([sample_r2(np.array([[1, 2, 3]], np.uint32), i) for i in range(samples)]).astype(float)
    points, normals = np.tile(point, (samples, 1)), np.tile(normal, (samples, 1))
    return direct_light.irradiance(lamp, points, points, normals, numbers, everything).mean(axis=0)


def test_point_light_above_a_plane():
    """E = I cos θ / d² = I h / (h² + r²)^{3/2}"""
    for distance in (0.0, 1.0, 5.0):
        expected = COLOR * 2 / (4 + distance**2) ** 1.5
        np.testing.assert_allclose(irradiance(light("POINT"), (distance, 0, 0)), expected, rtol=1e-12)


def test_light_below_the_horizon_gives_nothing():
    for kind in ("POINT", "SPOT", "SUN", "AREA"):
        lamp = light(kind, spot_size=2.0, size_x=1, size_y=1)
        assert not irradiance(lamp, normal=(0, 0, -1)).any()


@pytest.mark.parametrize("radius", [0.1, 0.5, 1.5])
def test_sphere_light_is_as_bright_as_its_centre(radius):
    """A sphere wholly above the horizon gives what its intensity at the centre would, for any radius: E = I cos θ /
    d²."""
    lamp = light("POINT", radius=radius, soft_falloff=False)
    np.testing.assert_allclose(irradiance(lamp), COLOR / 4, rtol=2e-3)
    np.testing.assert_allclose(irradiance(lamp, (1, 0, 0)), COLOR * 2 / 5**1.5, rtol=5e-3)


@pytest.mark.parametrize("radius", [0.1, 0.5, 1.5, 3.0])
def test_soft_falloff(radius):
    """A disk of radiance I/πr² facing the point: E = I / (d² + r²)."""
    np.testing.assert_allclose(irradiance(light("POINT", radius=radius)), COLOR / (4 + radius**2), rtol=5e-3)


def test_inside_a_sphere_light_is_finite():
    assert np.isfinite(irradiance(light("POINT", radius=3.0, soft_falloff=False))).all()
    assert np.isfinite(irradiance(light("POINT", position=(0, 0, 0)))).all()


@pytest.mark.parametrize("angle", [0.0, np.radians(0.526), 0.5, 2.0])
def test_sun_strength_is_irradiance(angle):
    lamp = light("SUN", direction=(0, 0, -1), angle=angle)
    np.testing.assert_allclose(irradiance(lamp), COLOR, rtol=3e-3)
    if angle < 1:
        slanted = light("SUN", direction=(1, 0, -1), angle=angle)
        np.testing.assert_allclose(irradiance(slanted), COLOR * np.cos(np.pi / 4), rtol=3e-3)


def test_spot_is_a_masked_point_light():
    lamp = light("SPOT", spot_size=np.radians(60), spot_blend=0.5)
    np.testing.assert_allclose(irradiance(lamp), COLOR / 4, rtol=1e-12)
    assert not irradiance(lamp, (2 * np.tan(np.radians(30.1)), 0, 0)).any()
    # half way through the edge, in cosine, smoothstep is one half
    cosine = np.cos(np.radians(30))
    middle = cosine + 0.25 * (1 - cosine)
    point = (2 * np.tan(np.arccos(middle)), 0, 0)
    np.testing.assert_allclose(irradiance(lamp, point), 0.5 * COLOR * middle**3 / 4, rtol=1e-9)


def test_hard_spot():
    lamp = light("SPOT", spot_size=np.radians(60), spot_blend=0.0)
    np.testing.assert_allclose(
        irradiance(lamp, (2 * np.tan(np.radians(29.9)), 0, 0)), COLOR * np.cos(np.radians(29.9)) ** 3 / 4, rtol=1e-6
    )
    assert not irradiance(lamp, (2 * np.tan(np.radians(30.1)), 0, 0)).any()


def rectangle_form_factor(width, depth, height):
    """Of a point below a corner of a parallel rectangle (Howell, "A Catalog of Radiation Heat Transfer", B-4)."""
    a, b = width / height, depth / height
    ra, rb = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
    return (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb)) / (2 * np.pi)


@pytest.mark.parametrize("size", [(0.1, 0.1), (1, 1), (3, 1), (8, 4)])
def test_rectangle(size):
    """E = π L F, four corners' rectangles around the point below the middle."""
    lamp = light("AREA", size_x=size[0], size_y=size[1])
    expected = np.pi * COLOR * 4 * rectangle_form_factor(size[0] / 2, size[1] / 2, 2)
    np.testing.assert_allclose(irradiance(lamp), expected, rtol=3e-3)


def test_rectangle_below_its_corner():
    lamp = light("AREA", position=(1.5, 1, 2), size_x=3, size_y=2)
    # the frame of the light may be turned: a square does not mind, so compare with both orders
    expected = [np.pi * COLOR * rectangle_form_factor(a, b, 2) for a, b in ((3, 2), (2, 3))]
    found = irradiance(lamp)
    assert any(np.allclose(found, value, rtol=3e-3) for value in expected)


@pytest.mark.parametrize("diameter", [0.2, 1.0, 4.0])
def test_disk(diameter):
    """E = π L r² / (r² + h²) below the middle of a disk."""
    lamp = light("AREA", shape="ELLIPSE", size_x=diameter, size_y=diameter)
    squared = diameter**2 / 4
    np.testing.assert_allclose(irradiance(lamp), np.pi * COLOR * squared / (squared + 4), rtol=3e-3)


def test_area_lights_shine_forward_only():
    assert not irradiance(light("AREA", direction=(0, 0, 1), size_x=1, size_y=1)).any()


@pytest.mark.parametrize("spread", [0.3, 1.0, 2.0, 3.0])
def test_spread_keeps_the_power(spread):
    """∫ attenuation · cos θ dω over the half sphere is π, as without spread; beyond half the spread there is
    nothing."""
    lamp = light("AREA", position=(0, 0, 0), size_x=1e-3, size_y=1e-3, spread=spread)
    theta = (np.arange(4000) + 0.5) * (np.pi / 2) / 4000
    points = 10 * np.stack([np.sin(theta), 0 * theta, -np.cos(theta)], 1)
    sample = direct_light.sample_light(lamp, points, np.full((4000, 2), 0.5))
    intensity = sample.irradiance[:, 0] * 100 / (COLOR[0] * 1e-6)  # L · cos θ · attenuation, per area
    power = (intensity * 2 * np.pi * np.sin(theta)).sum() * (np.pi / 2) / 4000
    assert power == pytest.approx(np.pi, rel=2e-3)
    assert not intensity[theta > spread / 2 + 1e-3].any()


def test_what_is_hidden_gets_nothing_and_shadowless_lights_do_not_ask():
    def nothing(origins, directions, limits):
        return np.zeros(len(origins), bool)

    assert not irradiance(light("POINT"), visible=nothing).any()
    assert irradiance(light("POINT", casts_shadow=False), visible=nothing).any()


def test_shadow_rays_start_at_the_origin_given_and_end_before_the_light():
    asked = []

    def record(origins, directions, limits):
        asked.append((origins, directions, limits))
        return np.ones(len(origins), bool)

    lamp = light("POINT", position=(0, 3, 4))
    start = np.array([[0, 0, 0.5]])
    direct_light.irradiance(lamp, np.zeros((1, 3)), start, np.array([[0, 0, 1.0]]), np.zeros((1, 2)), record)
    np.testing.assert_array_equal(asked[0][0], start)
    np.testing.assert_allclose(asked[0][1], [[0, 0.6, 0.8]])
    assert 4.99 < asked[0][2][0] < 5


def test_half_a_rectangle_hidden_is_half_the_light():
    lamp = light("AREA", size_x=2, size_y=2)

    def left(origins, directions, limits):
        return directions[:, 0] < 0

    np.testing.assert_allclose(irradiance(lamp, visible=left), irradiance(lamp) / 2, rtol=5e-3)


def test_tangent_frames_are_orthonormal():
    axes = np.random.default_rng(0).normal(size=(500, 3))
    axes = np.concatenate([axes / np.linalg.norm(axes, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    frames = np.stack([*direct_light.tangent_frame(axes), axes], axis=1)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (len(axes), 1, 1)), atol=1e-9)


def test_profile_of_a_lamp():
    """By direction in the lamp's own frame, and a power law of the distance, also past the ends of its curve."""
    z = panorama_directions(WIDTH, HEIGHT)[..., 2:]
    downwards = LightProfile(np.where(z < 0, [1.0, 0.5, 0.25], 0.0), DISTANCES_M**0.5)
    for distance in (0.1, 1.0, 3.0, 300.0):
        below = irradiance(light("POINT", (0, 0, distance), direction=(0, 0, -1), profile=downwards), samples=1)
        np.testing.assert_allclose(below, COLOR * [1.0, 0.5, 0.25] * distance**-1.5, rtol=1e-6)
    turned = light("POINT", (0, 0, 2), direction=(0, 0, 1), profile=downwards)
    assert not irradiance(turned, samples=1).any(), "it sends its light up"
    assert LightProfile(z, z[0, :5, 0]) != downwards == LightProfile(downwards.by_direction, DISTANCES_M**0.5)
