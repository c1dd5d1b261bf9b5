# SPDX-License-Identifier: GPL-3.0-or-later
"""What closures send back in all, against Cycles: a plane under a white sky."""

import numpy as np
import pytest
from gridlight.core.faint_gloss import albedo_towards, coupled, couplings, faint_rows
from gridlight.core.panorama import panorama_irradiance
from gridlight.scene.cycles_reference import render_panoramas
from gridlight.scene.read import read_scene
from gridlight.tests import scenes
from scene_builders import empty_scene, material, place, quad

PRINCIPLED = "ShaderNodeBsdfPrincipled"


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        (PRINCIPLED, {}),
        (PRINCIPLED, {"Base Color": (0.02, 0.3, 0.9, 1), "Roughness": 0.2}),
        (PRINCIPLED, {"Base Color": (0.02, 0.3, 0.9, 1), "Roughness": 0.9, "Specular IOR Level": 1.0}),
        (PRINCIPLED, {"Base Color": (0.2, 0.5, 0.9, 1), "Metallic": 1.0, "Roughness": 0.3}),
        (PRINCIPLED, {"Base Color": (0.2, 0.5, 0.9, 1), "Metallic": 0.5, "Roughness": 0.8}),
        (PRINCIPLED, {"Coat Weight": 1.0, "Coat Tint": (0.3, 0.6, 1, 1), "Specular IOR Level": 0.0}),
        (PRINCIPLED, {"Sheen Weight": 0.7, "Sheen Tint": (1, 0.2, 0.2, 1), "Base Color": (0.1, 0.1, 0.1, 1)}),
        (PRINCIPLED, {"Diffuse Roughness": 0.8, "Base Color": (0.2, 0.5, 0.9, 1), "Specular IOR Level": 0.0}),
        ("ShaderNodeBsdfDiffuse", {"Roughness": 0.6, "Color": (0.2, 0.5, 0.9, 1)}),
        ("ShaderNodeBsdfGlossy", {"Roughness": 0.7, "Color": (0.2, 0.5, 0.9, 1)}),
        ("ShaderNodeBsdfSheen", {"Roughness": 0.4, "Color": (0.2, 0.5, 0.9, 1)}),
    ],
)
def test_albedo_under_a_white_sky(kind, inputs):
    scene = empty_scene()
    scene.world = scenes.new_scene("sky", world=(1, 1, 1)).world
    data = quad()
    data.materials.append(material("Subject", kind, inputs))
    place(data, scale=(100, 100, 1))
    image = render_panoramas(scene, np.array([[0, 0, 0.5]]), 64, 32, 16, bounces=1)[0]
    expected = panorama_irradiance(image, np.array([[0, 0, -1.0]]))[0] / np.pi
    assert read_scene(scene).materials[0].base_color == pytest.approx(expected, abs=0.012)


@pytest.mark.any_version
@pytest.mark.parametrize(("grey", "tolerance"), [(0.8, 0.012), (0.03, 0.06)])
def test_plastic_by_angles(grey, tolerance):
    """What a Principled BSDF as Blender adds it sends to each angle under a white sky, and in all under suns: see
    core/faint_gloss.py."""
    elevation = (np.arange(32) + 0.5) / 32 * np.pi - np.pi / 2
    rows = np.flatnonzero(elevation < -0.12)
    cosine, weight = -np.sin(elevation[rows]), -np.sin(elevation[rows]) * np.cos(elevation[rows])
    for zenith in (None, 0, 65):
        scene = empty_scene()
        scene.world = scenes.new_scene("sky", world=(1, 1, 1) if zenith is None else (0, 0, 0)).world
        data = quad()
        data.materials.append(material("Plastic", PRINCIPLED, {"Base Color": (grey, grey, grey, 1)}))
        place(data, scale=(300, 300, 1))
        if zenith is not None:
            irradiance = np.pi / np.cos(np.radians(zenith))
            scenes.add_light(scene, "SUN", (0, 0, 5), energy=irradiance, angle=0.05).rotation_euler[0] = np.radians(
                zenith
            )
        image = render_panoramas(scene, np.array([[0, 0, 0.5]]), 32, 32, 64, bounces=1)[0]
        sent = image[rows].astype(float).mean(axis=(1, 2))
        row = read_scene(scene).materials[0]
        gloss = np.repeat(faint_rows([row.faint_gloss or row.gloss]), len(rows), axis=0)
        albedo = np.full((len(rows), 3), row.base_color[0])
        expected = albedo_towards(gloss, albedo, cosine)[:, 0]
        if zenith is None:
            np.testing.assert_allclose(sent, expected, rtol=tolerance)
            continue
        expected *= coupled(couplings(gloss, albedo), np.full(len(rows), np.cos(np.radians(zenith))))[:, 0]
        assert (weight * sent).sum() == pytest.approx((weight * expected).sum(), rel=tolerance)
