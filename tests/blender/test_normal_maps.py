# SPDX-License-Identifier: GPL-3.0-or-later
"""What normal maps leave of a diffuse surface."""

import numpy as np
import pytest
from scene_builders import empty_scene, image, node
from shaded_square import built, read


def sent_back(normal, strength=1.0):
    """Reflectance of a grey of 0.5 under a map of one ``normal`` (3,), against that without."""
    pixels = np.ones((4, 4, 4))
    pixels[..., :3] = (np.array(normal) + 1) / 2

    def shader(tree):
        shown = node(tree, "ShaderNodeTexImage", image=image("map", pixels, "Non-Color"))
        turned = node(tree, "ShaderNodeNormalMap", {"Color": shown.outputs["Color"], "Strength": strength})
        color = {"Color": (0.5, 0.5, 0.5, 1.0), "Normal": turned.outputs[0]}
        return node(tree, "ShaderNodeBsdfDiffuse", color).outputs[0]

    return read(empty_scene(), built(shader))[0].base_color[0] / 0.5


def hemisphere_share(angle):
    """Of even light above, what a diffuse normal that leans by ``angle`` sends back under Smith's shadowing function of
    a GGX surface of α² = tan² / 8, by directions on a spiral."""
    count = 200_000
    z = (np.arange(count) + 0.5) / count
    turn = np.arange(count) * 2.399963229728653
    x = np.sqrt(1 - z * z) * np.cos(turn)
    cosine = np.maximum(x * np.sin(angle) + z * np.cos(angle), 0.0)
    shadowing = 2 / (1 + np.sqrt(1 + np.tan(angle) ** 2 / 8 * (1 / z**2 - 1)))
    return (2 * cosine * shadowing).mean()


@pytest.mark.parametrize("degrees", [0, 10, 20, 41, 60])
def test_leaning_normals_send_less_back(degrees):
    angle = np.radians(degrees)
    assert sent_back((np.sin(angle), 0, np.cos(angle))) == pytest.approx(hemisphere_share(angle), abs=0.004)


def test_strength_flattens():
    """Half as strong, a normal of 45° leans by atan(0.5 · sin / (1 + 0.5 · (cos − 1)))."""
    sine = np.sqrt(0.5)
    angle = np.arctan2(0.5 * sine, 1 + 0.5 * (sine - 1))
    assert sent_back((sine, 0, sine), 0.5) == pytest.approx(hemisphere_share(angle), abs=0.004)
    assert sent_back((sine, 0, sine), 0.0) == 1.0
