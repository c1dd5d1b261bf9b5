# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light of Blender's lights at a diffuse surface: the readable twin of gpu_shaders/glsl/direct_light_lib.glsl.

Units are those of ``core.snapshot.Light``; they are Blender's (Cycles manual, "Light Settings", and its source). Every
light is an emitter of radiance L seen under a solid angle: irradiance is E = ∫ L cos θ dω, estimated as the mean over
samples of (L · dω of the whole light as seen in the sample's direction) · cos θ · visible.

N points, M light samples, float64.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .sampling import sample_disk, tangent_frame
from .snapshot import Light

Visible = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(origins (M, 3), unit directions (M, 3), distances (M,)) -> (M,) bool: nothing lies nearer than the distance."""

# Radians; from here on an area light's grid is taken as absent, as Blender's slider ends at 180°.
_FULL_SPREAD = np.pi - 1e-4
_LEAST_HALF_SPREAD = 1e-3  # radians
_LEAST_BLEND = 1e-6  # of a spot's soft edge, in cosine
_SHADOW_END = 0.9999  # of the distance to the light: the light's own surface casts no shadow


@dataclass(frozen=True)
class LightSamples:
    """One sample of a light per point."""

    directions: np.ndarray  # (N, 3) unit, towards the light
    distances: np.ndarray  # (N,) metres, infinite for suns
    irradiance: np.ndarray  # (N, 3) per unit cosine at the surface


def irradiance(
    light: Light, points: np.ndarray, origins: np.ndarray, normals: np.ndarray, u: np.ndarray, visible: Visible
) -> np.ndarray:
    """(N, 3) irradiance of ``light`` at ``points`` (N, 3) with unit ``normals`` (N, 3), world metres, by one sample
    each.

    ``u`` (N, 2) in [0, 1) picks the place on the light; the mean over many is the irradiance, one is exact where the
    light has no extent. Shadow rays start at ``origins`` (N, 3), the points stepped off their surface.
    """
    sample = sample_light(light, points, u)
    unshadowed = unshadowed_irradiance(sample, normals)
    lit = unshadowed.any(axis=1)
    lit[lit] = arrives(light, sample, origins, lit, visible)
    return np.where(lit[:, None], unshadowed, 0.0)


def unshadowed_irradiance(sample: LightSamples, normals: np.ndarray) -> np.ndarray:
    """(N, 3) irradiance by ``sample`` at surfaces with unit ``normals`` (N, 3) if nothing stands between."""
    cosine = np.einsum("ni,ni->n", sample.directions, normals)
    return np.maximum(cosine, 0.0)[:, None] * sample.irradiance


def arrives(light: Light, sample: LightSamples, origins: np.ndarray, of: np.ndarray, visible: Visible) -> np.ndarray:
    """Bool for those places ``of`` (N,) bool: does what ``sample`` of ``light`` sends get to ``origins`` (N, 3)?"""
    if not light.casts_shadow:
        return np.ones(np.count_nonzero(of), bool)
    return visible(origins[of], sample.directions[of], sample.distances[of] * _SHADOW_END)


def sample_light(light: Light, points: np.ndarray, u: np.ndarray) -> LightSamples:
    """The sample of ``light`` that numbers ``u`` (N, 2) in [0, 1) pick at each of ``points`` (N, 3)."""
    if light.kind == "SUN":
        return _sample_sun(light, u)
    sample = (_sample_area if light.kind == "AREA" else _sample_point)(light, points, u)
    factor = np.ones((len(points), 1))
    if light.kind == "SPOT":
        factor = spot_mask(light, sample.directions)[:, None]
    if light.profile is not None:
        local = -sample.directions @ np.asarray(light.matrix, float)[:3, :3]
        factor = factor * light.profile.factor(local, sample.distances)
    return LightSamples(sample.directions, sample.distances, sample.irradiance * factor)


def _sample_sun(light: Light, u: np.ndarray) -> LightSamples:
    """Uniform in the cone of half the apparent angle α. Its radiance is strength/(π sin² α), so that a facing surface
    gets exactly the strength: ∫ cos θ dω over the cone is π sin² α. Times the cone's solid angle 2π(1 − cos α) that is
    strength · 2/(1 + cos α).
    """
    back = np.asarray(light.matrix, float)[:3, 2]
    one_minus_cos = 1.0 - np.cos(light.angle / 2)
    directions = _in_cone(np.broadcast_to(back, (len(u), 3)), one_minus_cos, u)
    strength = np.asarray(light.color) * (2.0 / (2.0 - one_minus_cos))
    return LightSamples(directions, np.full(len(u), np.inf), np.broadcast_to(strength, (len(u), 3)).copy())


def _sample_area(light: Light, points: np.ndarray, u: np.ndarray) -> LightSamples:
    """Uniform on the face of radiance L: dω = cos θ_light · area / distance². The face shines along −back only.

    Spread below 180° puts a grid in front: the share of the face that is seen at the angle θ falls linearly in tan θ
    to zero at half the spread and is normalised so that total power stays (Cycles, ``area_light_spread_attenuation``).
    """
    matrix = np.asarray(light.matrix, float)
    right, up, back, centre = matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3]
    is_ellipse = light.shape == "ELLIPSE"
    place = 0.5 * sample_disk(u) if is_ellipse else u - 0.5
    to_light = centre - points + place[:, :1] * light.size_x * right + place[:, 1:] * light.size_y * up
    distances = np.linalg.norm(to_light, axis=1)
    directions = to_light / np.maximum(distances, 1e-20)[:, None]
    cosine = directions @ back
    area = light.size_x * light.size_y * (np.pi / 4 if is_ellipse else 1.0)
    factor = spread_share(light, cosine) * np.maximum(cosine, 0) * area / np.maximum(distances * distances, 1e-20)
    return LightSamples(directions, distances, factor[:, None] * np.asarray(light.color))


def _sample_point(light: Light, points: np.ndarray, u: np.ndarray) -> LightSamples:
    """Point and spot of radiant intensity I: I/d² without a radius, otherwise one of two shapes of radius r.

    * Soft falloff, or a point within the radius: a disk of radiance I/(πr²) that faces the point.
    * Else a sphere of radiance I/(πr²), uniform in the cone that it fills, sin² of whose half angle is r²/d².
    """
    colour, radius = np.asarray(light.color, float), light.radius
    to_centre = np.asarray(light.matrix, float)[:3, 3] - points
    squared = np.maximum(np.einsum("ni,ni->n", to_centre, to_centre), 1e-20)
    centre_distance = np.sqrt(squared)
    axis = to_centre / centre_distance[:, None]
    if radius == 0:
        return LightSamples(axis, centre_distance, colour / squared[:, None])

    tangent, bitangent = tangent_frame(axis)
    disk = radius * sample_disk(u)
    to_disk = to_centre + disk[:, :1] * tangent + disk[:, 1:] * bitangent
    disk_distance = np.linalg.norm(to_disk, axis=1)
    # radiance × area × cos at the disk / distance², and cos at the disk is centre_distance / distance
    disk_factor = centre_distance / disk_distance**3
    if light.soft_falloff:
        return LightSamples(to_disk / disk_distance[:, None], disk_distance, disk_factor[:, None] * colour)

    inside = centre_distance <= radius
    sine_squared = np.where(inside, 0.0, radius**2 / squared)
    one_minus_cos = 1.0 - np.sqrt(1.0 - sine_squared)
    directions = _in_cone(axis, one_minus_cos, u)
    cosine = np.einsum("ni,ni->n", directions, axis)
    depth = np.sqrt(np.maximum(radius**2 - squared * (1 - cosine**2), 0))
    factor = np.where(inside, disk_factor, 2.0 * one_minus_cos / radius**2)
    return LightSamples(
        np.where(inside[:, None], to_disk / disk_distance[:, None], directions),
        np.where(inside, disk_distance, centre_distance * cosine - depth),
        factor[:, None] * colour,
    )


def extent(light: Light, points: np.ndarray) -> np.ndarray:
    """(N,) steradians, roughly, under which ``points`` (N, 3) see ``light``: by its size and the distance of its
    middle."""
    if light.kind == "SUN":
        return np.full(len(points), 2 * np.pi * (1.0 - np.cos(light.angle / 2)))
    area = np.pi * light.radius**2
    if light.kind == "AREA":
        area = light.size_x * light.size_y * (np.pi / 4 if light.shape == "ELLIPSE" else 1.0)
    to_centre = np.asarray(light.matrix, float)[:3, 3] - points
    return area / np.maximum(np.einsum("ni,ni->n", to_centre, to_centre), 1e-20)


def met(light: Light, points: np.ndarray, directions: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """(N, 3) radiance of ``light`` that rays from ``points`` along ``directions`` (N, 3 each) meet nearer than
    ``limits`` (N,), suns only where these are infinite."""
    radiance, distance = meeting(light, points, directions)
    return np.where(((distance < limits) | np.isinf(limits))[:, None], radiance, 0.0)


def meeting(light: Light, points: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) radiance of ``light`` that such rays meet if nothing stands between, and how far off (N,), infinite for
    suns; the shapes are those that ``sample_light`` samples."""
    matrix = np.asarray(light.matrix, float)
    colour, far = np.asarray(light.color, float), np.full(len(points), np.inf)
    if light.kind == "SUN":
        one_minus_cos = 1.0 - np.cos(light.angle / 2)
        if one_minus_cos == 0:
            return np.zeros((len(points), 3)), far
        hit = 1.0 - directions @ matrix[:3, 2] < one_minus_cos
        return np.where(hit[:, None], colour / (np.pi * one_minus_cos * (2.0 - one_minus_cos)), 0.0), far
    to_centre = matrix[:3, 3] - points
    if light.kind == "AREA":
        hit, distance, factor = _met_area(light, to_centre, directions)
    elif light.radius > 0:
        hit, distance = _met_ball(light, to_centre, directions)
        factor = np.full(len(points), 1.0 / (np.pi * light.radius**2))
    else:
        return np.zeros((len(points), 3)), far
    factor = np.where(hit, factor, 0.0)
    if light.kind == "SPOT":
        factor *= spot_mask(light, directions)
    factor = factor[:, None] * colour
    if light.profile is not None:
        factor *= light.profile.factor(-directions @ matrix[:3, :3], np.where(hit, distance, 1.0))
    return factor, np.where(hit, distance, np.inf)


def _met_area(light: Light, to_centre: np.ndarray, directions: np.ndarray):
    matrix = np.asarray(light.matrix, float)
    cosine = directions @ matrix[:3, 2]
    distance = (to_centre @ matrix[:3, 2]) / np.where(cosine > 1e-6, cosine, 1.0)
    place = directions * distance[:, None] - to_centre
    x, y = place @ matrix[:3, 0] / max(light.size_x, 1e-20), place @ matrix[:3, 1] / max(light.size_y, 1e-20)
    inside = x * x + y * y < 0.25 if light.shape == "ELLIPSE" else np.maximum(np.abs(x), np.abs(y)) < 0.5
    return (cosine > 1e-6) & (distance > 0) & inside, distance, spread_share(light, cosine)


def _met_ball(light: Light, to_centre: np.ndarray, directions: np.ndarray):
    squared = np.einsum("ni,ni->n", to_centre, to_centre)
    along = np.einsum("ni,ni->n", to_centre, directions)
    as_disk = light.soft_falloff | (squared <= light.radius**2)
    reach = squared / np.where(along > 0, along, 1.0)  # along the ray to the disk that faces the point
    beside = reach * reach - squared
    aside = squared - along * along
    near = along - np.sqrt(np.maximum(light.radius**2 - aside, 0.0))
    hit = np.where(as_disk, beside < light.radius**2, aside < light.radius**2) & (along > 0)
    return hit, np.where(as_disk, reach, near)


def spread_share(light: Light, cosine: np.ndarray) -> np.ndarray:
    """(N,) share of an area light's radiance that its grid lets through at ``cosine`` (N,) to its axis."""
    if light.spread >= _FULL_SPREAD:
        return np.ones(len(cosine))
    half = max(light.spread / 2, _LEAST_HALF_SPREAD)
    tangent = np.sqrt(np.maximum(1 - cosine * cosine, 0)) / np.maximum(cosine, 1e-6)
    return np.maximum(np.tan(half) - tangent, 0) / (np.tan(half) - half)


def spot_mask(light: Light, directions: np.ndarray) -> np.ndarray:
    """(N,) share of a spot's light sent against ``directions`` (N, 3): smoothstep in the cosine, 1 inside, 0 outside
    the cone.

    The cone lives in the object's own frame, so the object's scale stretches it.
    """
    cosine = np.cos(light.spot_size / 2)
    width = max((1 - cosine) * light.spot_blend, _LEAST_BLEND)
    scale = np.asarray(light.spot_scale, float)
    local = directions @ np.asarray(light.matrix, float)[:3, :3] * (scale[2] / scale)
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    x = np.clip((local[:, 2] - cosine) / width, 0, 1)
    return x * x * (3 - 2 * x)


def _in_cone(axis: np.ndarray, one_minus_cos: np.ndarray | float, u: np.ndarray) -> np.ndarray:
    """(N, 3) directions spread evenly over the cones around ``axis`` (N, 3) whose half angles have the cosine 1 −
    ``one_minus_cos``."""
    tangent, bitangent = tangent_frame(axis)
    cosine = 1.0 - u[:, 0] * one_minus_cos
    sine, angle = np.sqrt(np.maximum(1 - cosine * cosine, 0)), 2 * np.pi * u[:, 1]
    return (
        cosine[:, None] * axis + (sine * np.cos(angle))[:, None] * tangent + (sine * np.sin(angle))[:, None] * bitangent
    )
