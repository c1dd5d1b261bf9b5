# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that let light through: holes by alpha, glass, shares of transparency, translucent sheets, absent backs."""

import numpy as np
import pytest
from gridlight.core.snapshot import (
    CAMERA_RAYS,
    DIFFUSE_RAYS,
    DITHERED,
    FROM_BEHIND,
    FROM_FRONT,
    NO_IMAGE,
    SHADOW_RAYS,
)
from scene_builders import empty_scene, image, material, node
from shaded_square import HALF, OPAQUE, built, read, textured, warned


@pytest.fixture
def scene():
    return empty_scene()


def test_transmission_is_a_share_of_holes(scene):
    read_material, snapshot = read(
        scene, material("Pane", "ShaderNodeBsdfPrincipled", {"Transmission Weight": 0.2, "Alpha": 0.5})
    )
    assert read_material.alpha == pytest.approx(0.4) and read_material.alpha_threshold == DITHERED
    assert warned(snapshot, "glass", "'Pane'")


@pytest.mark.parametrize("way", ["principled", "mix", "threshold"])
def test_leaves_are_clipped_by_their_alpha(scene, way):
    def shader(tree):
        shown = node(tree, "ShaderNodeTexImage", image=image("leaf", HALF), extension="CLIP")
        alpha = shown.outputs["Alpha"]
        if way == "principled":
            return node(
                tree,
                "ShaderNodeBsdfPrincipled",
                {"Base Color": shown.outputs["Color"], "Alpha": alpha, "Specular IOR Level": 0.0},
            ).outputs[0]
        if way == "threshold":
            alpha = node(tree, "ShaderNodeMath", {"Value": alpha, "Value_001": 0.3}, operation="GREATER_THAN").outputs[
                0
            ]
        leaf = node(tree, "ShaderNodeBsdfDiffuse", {"Color": shown.outputs["Color"]})
        hole = node(tree, "ShaderNodeBsdfTransparent")
        return node(
            tree, "ShaderNodeMixShader", {"Fac": alpha, "Shader": hole.outputs[0], "Shader_001": leaf.outputs[0]}
        ).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    assert read_material.alpha_threshold == DITHERED
    assert read_material.base_image == read_material.alpha_image == 0 and len(snapshot.images) == 1
    pixels = snapshot.images[0].pixels
    assert np.allclose(pixels[:, :4, 3], 0) and np.allclose(pixels[:, 4:], [0.2, 0.4, 0.6, 1], atol=1e-6)
    assert snapshot.images[0].extension == "CLIP" and not snapshot.warnings


def test_colour_is_premultiplied_where_alpha_is_not_used(scene):
    read_material, snapshot = read(
        scene, built(lambda tree: node(tree, "ShaderNodeBsdfDiffuse", {"Color": textured(tree)}).outputs[0])
    )
    pixels = snapshot.images[read_material.base_image].pixels
    assert np.allclose(pixels[:, :4, :3], 0) and np.allclose(pixels[:, 4:, :3], [0.2, 0.4, 0.6])
    assert read_material.alpha_image == NO_IMAGE


def test_constant_transparency(scene):
    read_material, snapshot = read(scene, material("Veil", "ShaderNodeBsdfPrincipled", {"Alpha": 0.7}))
    assert read_material.alpha == pytest.approx(0.7) and read_material.alpha_threshold == DITHERED
    scene = empty_scene()
    _, snapshot = read(scene, material("Air", "ShaderNodeBsdfPrincipled", {"Alpha": 0.0}))
    assert len(snapshot.triangles) == 0


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("ShaderNodeBsdfGlass", {}),
        ("ShaderNodeBsdfRefraction", {}),
        ("ShaderNodeBsdfPrincipled", {"Base Color": (1, 1, 1, 1), "Transmission Weight": 1.0}),
    ],
)
def test_glass_lets_light_through(scene, kind, inputs):
    _, snapshot = read(scene, material("Pane", kind, inputs))
    assert len(snapshot.triangles) == 0 and warned(snapshot, "glass", "'Pane'")


def test_fully_transparent_surfaces_go_without_a_warning(scene):
    _, snapshot = read(scene, material("m", "ShaderNodeBsdfTransparent"))
    assert len(snapshot.triangles) == 0 and not snapshot.warnings


def test_translucent_lets_light_through(scene):
    """Alone, mixed, added, and beside holes: what is sent back in all, and the share that has gone through."""

    def shader(tree, way):
        diffuse = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.4, 0.2, 0.6, 1)}).outputs[0]
        through = node(tree, "ShaderNodeBsdfTranslucent", {"Color": (0.4, 0.6, 0.0, 1)}).outputs[0]
        hole = node(tree, "ShaderNodeBsdfTransparent").outputs[0]
        if way == "alone":
            return through
        if way == "added":
            return node(tree, "ShaderNodeAddShader", {"Shader": diffuse, "Shader_001": through}).outputs[0]
        if way == "beside holes":
            return node(tree, "ShaderNodeMixShader", {"Fac": 0.5, "Shader": hole, "Shader_001": through}).outputs[0]
        return node(tree, "ShaderNodeMixShader", {"Fac": 0.25, "Shader": diffuse, "Shader_001": through}).outputs[0]

    for way, color, share, alpha in (
        ("alone", (0.4, 0.6, 0.0), (1, 1, 1), 1),
        ("added", (0.8, 0.8, 0.6), (0.5, 0.75, 0), 1),
        ("mixed", (0.4, 0.3, 0.45), (0.25, 0.5, 0), 1),
        ("beside holes", (0.4, 0.6, 0.0), (1, 1, 1), 0.5),
    ):
        made, snapshot = read(empty_scene(), built(lambda tree, way=way: shader(tree, way)))
        assert made.base_color == pytest.approx(color) and made.transmitted == pytest.approx(share), way
        assert made.alpha == pytest.approx(alpha) and not snapshot.warnings


def test_a_pattern_of_translucency_enters_with_its_mean(scene):
    """One image for both parts keeps it, as they differ by a factor; another one does not, and says so."""

    def shader(tree, shared):
        color = textured(tree, pixels=OPAQUE)
        diffuse = node(tree, "ShaderNodeBsdfDiffuse", {"Color": color}).outputs[0]
        through = node(tree, "ShaderNodeBsdfTranslucent", {"Color": color if shared else (0.2, 0.4, 0.2, 1)}).outputs[0]
        return node(tree, "ShaderNodeMixShader", {"Fac": 0.25, "Shader": diffuse, "Shader_001": through}).outputs[0]

    for shared, share in ((True, (0.25, 0.25, 0.25)), (False, (0.25, 0.25, 0.1))):
        made, snapshot = read(empty_scene(), built(lambda tree, shared=shared: shader(tree, shared)))
        assert made.transmitted == pytest.approx(share, abs=0.01) and made.base_image != NO_IMAGE
        assert warned(snapshot, "translucency", "'Subject'") != shared


def two_sided(front, back):
    """A material that shows ``front`` from the front and ``back`` from behind: nodes' kinds and inputs."""

    def shader(tree):
        facing = node(tree, "ShaderNodeNewGeometry").outputs["Backfacing"]
        one, other = (node(tree, kind, inputs).outputs[0] for kind, inputs in (front, back))
        return node(tree, "ShaderNodeMixShader", {"Fac": facing, "Shader": one, "Shader_001": other}).outputs[0]

    return built(shader)


def rows_of(snapshot):
    """What the triangles of the subject are made of, row by row: colour, emission, who does not see it, number."""
    rows = [
        (snapshot.materials[index], int((snapshot.material_index == index).sum()))
        for index in np.unique(snapshot.material_index)
    ]
    return [(made.base_color, made.emission, made.unseen_by, count) for made, count in rows]


DIFFUSE = ("ShaderNodeBsdfDiffuse", {"Color": (0.4, 0.2, 0.6, 1)})
GREY = ("ShaderNodeBsdfDiffuse", {"Color": (0.5, 0.5, 0.5, 1)})
GLOW = ("ShaderNodeEmission", {"Color": (1, 1, 1, 1), "Strength": 3.0})
CLEAR = ("ShaderNodeBsdfTransparent", {})


@pytest.mark.parametrize(
    ("front", "back", "expected"),
    [
        (DIFFUSE, CLEAR, [((0.4, 0.2, 0.6), (0, 0, 0), FROM_BEHIND, 2)]),
        (CLEAR, DIFFUSE, [((0.4, 0.2, 0.6), (0, 0, 0), FROM_FRONT, 2)]),
        (GLOW, CLEAR, [((0, 0, 0), (3, 3, 3), FROM_BEHIND, 2)]),
        (DIFFUSE, DIFFUSE, [((0.4, 0.2, 0.6), (0, 0, 0), 0, 2)]),
        (DIFFUSE, GREY, [((0.4, 0.2, 0.6), (0, 0, 0), FROM_BEHIND, 2), ((0.5,) * 3, (0, 0, 0), FROM_FRONT, 2)]),
        (GLOW, GREY, [((0, 0, 0), (3, 3, 3), FROM_BEHIND, 2), ((0.5,) * 3, (0, 0, 0), FROM_FRONT, 2)]),
    ],
)
def test_backs_of_their_own(scene, front, back, expected):
    """The triangles come twice where both sides are there, each for those who look at its side."""
    _made, snapshot = read(empty_scene(), two_sided(front, back))
    found = rows_of(snapshot)
    assert len(found) == len(expected) and not snapshot.warnings
    for row, other in zip(found, expected):
        assert row[:2] == (pytest.approx(other[0]), pytest.approx(other[1])) and row[2:] == other[2:]
    assert set(snapshot.object_index) == {0} and len(snapshot.object_names) == 1


def test_shadows_of_their_own(scene):
    """A surface that lets shadow rays through, wholly or half, and one that only they see."""

    def shader(tree, shown, shadow):
        ray = node(tree, "ShaderNodeLightPath").outputs["Is Shadow Ray"]
        one, other = (node(tree, kind, inputs).outputs[0] for kind, inputs in (shown, shadow))
        return node(tree, "ShaderNodeMixShader", {"Fac": ray, "Shader": one, "Shader_001": other}).outputs[0]

    veil = ("ShaderNodeBsdfTransparent", {"Color": (0.5, 0.5, 0.5, 1)})
    unseen = DIFFUSE_RAYS | CAMERA_RAYS
    colour = (0.4, 0.2, 0.6)
    for shown, shadow, expected in (
        (DIFFUSE, CLEAR, [(colour, SHADOW_RAYS, 1.0)]),
        (DIFFUSE, veil, [(colour, SHADOW_RAYS, 1.0), ((0, 0, 0), unseen, 0.5)]),
        (CLEAR, GREY, [((0, 0, 0), unseen, 1.0)]),
        (DIFFUSE, GREY, [(colour, 0, 1.0)]),
    ):
        _made, snapshot = read(empty_scene(), built(lambda tree, a=shown, b=shadow: shader(tree, a, b)))
        found = [snapshot.materials[index] for index in np.unique(snapshot.material_index)]
        assert [(row.unseen_by, row.alpha) for row in found] == [row[1:] for row in expected]
        assert all(row.base_color == pytest.approx(other[0]) for row, other in zip(found, expected))
        assert not snapshot.warnings


def test_coloured_holes():
    """Transparent and Glass have their colour, Principled the root of it: light passes two faces of a solid."""
    for kind, inputs, tint in (
        ("ShaderNodeBsdfTransparent", {"Color": (0.8, 0.2, 0.4, 1)}, (0.8, 0.2, 0.4)),
        ("ShaderNodeBsdfGlass", {"Color": (0.5, 1.0, 0.5, 1)}, (0.5, 1.0, 0.5)),
        ("ShaderNodeBsdfPrincipled", {"Base Color": (0.25, 1, 0.64, 1), "Transmission Weight": 1.0}, (0.5, 1, 0.8)),
    ):
        found, _snapshot = read(empty_scene(), material(kind, kind, inputs))
        assert found.is_tinted and found.alpha == 0.0 and found.alpha_threshold == DITHERED
        assert np.allclose(found.tint, tint, atol=1e-4)


def test_a_mix_with_coloured_holes(scene):
    """Half of the area is hole as far as its brightest channel asks for; the other half is what it was."""

    def shader(tree):
        hole = node(tree, "ShaderNodeBsdfTransparent", {"Color": (0.2, 0.4, 0.8, 1)})
        leaf = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.6, 0.3, 0.3, 1)})
        return node(
            tree, "ShaderNodeMixShader", {"Fac": 0.5, "Shader": hole.outputs[0], "Shader_001": leaf.outputs[0]}
        ).outputs[0]

    found, snapshot = read(scene, built(shader))
    passed = (1 - found.alpha) * np.array(found.tint)
    assert np.allclose(passed, [0.1, 0.2, 0.4], atol=1e-4)
    assert np.allclose(found.alpha * np.array(found.base_color), [0.3, 0.15, 0.15], atol=1e-4) and not snapshot.warnings


def test_a_window_of_coloured_panes(scene):
    """All of it is hole, and its picture the colour of what passes."""
    found, snapshot = read(
        scene, built(lambda tree: node(tree, "ShaderNodeBsdfTransparent", {"Color": textured(tree)}).outputs[0])
    )
    assert found.alpha == 0.0 and found.alpha_image == NO_IMAGE
    picture = snapshot.images[found.tint_image].pixels
    assert np.allclose(picture[:, 4:, :3] * found.tint, [0.2, 0.4, 0.6], atol=1e-4)
    assert np.allclose(picture[:, :4, :3], 0, atol=1e-4)
