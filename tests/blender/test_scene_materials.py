# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: what each kind of shader becomes, and that nothing turns black in silence."""

import bpy
import numpy as np
import pytest
from gridlight.core.snapshot import NO_IMAGE
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, image, material, node, place, quad, with_nodes
from shaded_square import OPAQUE, built, read, textured, warned


@pytest.fixture
def scene():
    return empty_scene()


@pytest.mark.parametrize(
    ("kind", "color"),
    [
        ("ShaderNodeBsdfDiffuse", "Color"),
        ("ShaderNodeSubsurfaceScattering", "Color"),
        ("ShaderNodeBsdfToon", "Color"),
    ],
)
def test_diffuse_colours(scene, kind, color):
    read_material, snapshot = read(scene, material("m", kind, {color: (0.1, 0.2, 0.3, 1)}))
    assert read_material.base_color == pytest.approx((0.1, 0.2, 0.3))
    assert read_material.emission == (0, 0, 0) and read_material.alpha_threshold == 0 and not snapshot.warnings


def test_material_without_nodes(scene):
    if bpy.app.version >= (5, 0):
        pytest.skip("every material has nodes in 5.x")
    made = bpy.data.materials.new("plain")
    made.use_nodes = False
    made.diffuse_color = (0.3, 0.2, 0.1, 1)
    assert read(scene, made)[0].base_color == pytest.approx((0.3, 0.2, 0.1))


def test_metal_mirrors_its_colour(scene):
    read_material, _ = read(
        scene, material("Steel", "ShaderNodeBsdfPrincipled", {"Base Color": (1, 0.5, 0.5, 1), "Metallic": 1.0})
    )
    assert read_material.base_color == pytest.approx((1, 0.48, 0.48), abs=0.01)
    gloss = read_material.gloss
    assert gloss.share == pytest.approx(read_material.base_color) and gloss.fixed
    assert gloss.facing == pytest.approx((1, 0.5, 0.5)) and gloss.roughness == pytest.approx(0.5)


def test_metal_of_an_image_mirrors_it(scene):
    def shader(tree):
        inputs = {"Base Color": textured(tree), "Metallic": 1.0, "Roughness": 0.2}
        return node(tree, "ShaderNodeBsdfPrincipled", inputs).outputs[0]

    read_material, _ = read(scene, built(shader))
    assert read_material.base_image >= 0
    assert read_material.gloss.share == pytest.approx((1, 1, 1)) and not read_material.gloss.fixed


@pytest.mark.parametrize(
    ("inputs", "share", "facing", "roughness"),
    [
        ({}, None, None, None),  # a Principled BSDF as Blender adds it
        ({"Base Color": (0.03, 0.03, 0.03, 1)}, None, None, None),  # shows lamps, and nothing else that matters
        ({"Base Color": (0.03, 0.03, 0.03, 1), "Roughness": 0.2}, 0.083, 0.04, 0.2),
        ({"Coat Weight": 1.0, "Coat Roughness": 0.05, "Specular IOR Level": 0.0}, 0.088, 0.04, 0.05),
    ],
)
def test_gloss_that_matters(scene, inputs, share, facing, roughness):
    gloss = read(scene, material("plastic", "ShaderNodeBsdfPrincipled", inputs))[0].gloss
    if share is None:
        assert gloss is None
        return
    assert gloss.share == pytest.approx((share,) * 3, abs=0.003) and gloss.facing == pytest.approx((facing,) * 3)
    assert gloss.roughness == pytest.approx(roughness) and gloss.fixed


def test_mixed_gloss_is_as_much_as_there_is_of_it(scene):
    def shader(tree):
        matte = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.2, 0.4, 0.6, 1)}).outputs[0]
        glossy = node(tree, "ShaderNodeBsdfAnisotropic", {"Color": (0.8, 0.8, 0.8, 1), "Roughness": 0.1}).outputs[0]
        return node(tree, "ShaderNodeMixShader", {"Fac": 0.25, "Shader": matte, "Shader_001": glossy}).outputs[0]

    read_material, _ = read(scene, built(shader))
    assert read_material.gloss.share == pytest.approx((0.2,) * 3, abs=0.005)
    assert read_material.base_color == pytest.approx((0.35, 0.5, 0.65), abs=0.005)


def test_emission_is_colour_times_strength(scene):
    read_material, _ = read(scene, material("m", "ShaderNodeEmission", {"Color": (1, 0.5, 0.25, 1), "Strength": 4.0}))
    assert read_material.emission == pytest.approx((4, 2, 1)) and read_material.base_color == (0, 0, 0)


def test_principled_emission(scene):
    read_material, _ = read(
        scene, material("p", "ShaderNodeBsdfPrincipled", {"Emission Color": (1, 0, 0.5, 1), "Emission Strength": 3.0})
    )
    assert read_material.emission == pytest.approx((3, 0, 1.5))
    assert read_material.base_color == pytest.approx((0.81, 0.81, 0.81), abs=0.005)


def test_image_texture_is_shared_between_tints(scene):
    def tinted(color):
        def shader(tree):
            shown = node(tree, "ShaderNodeTexImage", image=picture)
            mixed = node(
                tree,
                "ShaderNodeMix",
                {"Factor_Float": 1.0, "A_Color": shown.outputs["Color"], "B_Color": color},
                data_type="RGBA",
                blend_type="MULTIPLY",
            )
            return node(tree, "ShaderNodeBsdfDiffuse", {"Color": mixed.outputs[2]}).outputs[0]

        return built(shader)

    picture = image("shared", OPAQUE)
    data = quad(uv_map="UVMap")
    place(data)
    data.materials.append(tinted((1, 0.5, 0.25, 1)))
    second = quad(uv_map="UVMap")
    place(second)
    second.materials.append(tinted((0.5, 0.5, 0.5, 1)))
    snapshot = read_scene(scene)
    assert len(snapshot.images) == 1
    assert [item.base_image for item in snapshot.materials] == [0, 0]
    assert snapshot.materials[0].base_color == pytest.approx((1, 0.5, 0.25))
    assert np.allclose(snapshot.images[0].pixels[0, 0], [0.2, 0.4, 0.6, 1])


def test_mix_and_add_shaders(scene):
    def shader(tree):
        red = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (1, 0, 0, 1)})
        lamp = node(tree, "ShaderNodeEmission", {"Color": (1, 1, 1, 1), "Strength": 2.0})
        blue = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0, 0, 1, 1)})
        mixed = node(
            tree, "ShaderNodeMixShader", {"Fac": 0.25, "Shader": red.outputs[0], "Shader_001": lamp.outputs[0]}
        )
        return node(tree, "ShaderNodeAddShader", {"Shader": mixed.outputs[0], "Shader_001": blue.outputs[0]}).outputs[0]

    read_material, _ = read(scene, built(shader))
    assert read_material.base_color == pytest.approx((0.75, 0, 1))
    assert read_material.emission == pytest.approx((0.5, 0.5, 0.5))


def test_glossy_keeps_its_energy(scene):
    read_material, _ = read(
        scene, material("Chrome", "ShaderNodeBsdfAnisotropic", {"Color": (0.9, 0.8, 0.7, 1), "Roughness": 0.1})
    )
    assert read_material.base_color == pytest.approx((0.9, 0.8, 0.7), abs=0.01)
    assert read_material.gloss.facing == (1, 1, 1) and read_material.gloss.roughness == pytest.approx(0.1)


def test_two_outputs_the_one_for_cycles_counts(scene):
    made = bpy.data.materials.new("m")
    tree = with_nodes(made)
    for color, target in (((1, 0, 0, 1), "EEVEE"), ((0, 1, 0, 1), "CYCLES"), ((0, 0, 1, 1), "ALL")):
        shader = node(tree, "ShaderNodeBsdfDiffuse", {"Color": color})
        node(tree, "ShaderNodeOutputMaterial", {"Surface": shader.outputs[0]}, target=target)
    assert read(scene, made)[0].base_color == (0, 1, 0)


def test_missing_image_falls_back_to_the_sockets_colour(scene, tmp_path):
    lost = bpy.data.images.new("Lost", 4, 4)
    lost.source = "FILE"
    lost.filepath = str(tmp_path / "nowhere.png")
    lost.reload()

    def shader(tree):
        shown = node(tree, "ShaderNodeTexImage", image=lost)
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": shown.outputs["Color"]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    assert read_material.base_color == pytest.approx((0.8, 0.8, 0.8)) and read_material.base_image == NO_IMAGE
    assert warned(snapshot, "'Lost'", "'Subject'", "missing") and len(snapshot.warnings) == 1


def test_image_by_generated_coordinates(scene):
    def shader(tree):
        coordinates = node(tree, "ShaderNodeTexCoord")
        shown = node(
            tree, "ShaderNodeTexImage", {"Vector": coordinates.outputs["Generated"]}, image=image("bands", OPAQUE)
        )
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": shown.outputs["Color"]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    pixels = snapshot.images[read_material.base_image].pixels
    assert np.allclose(pixels[..., :3], [0.2, 0.4, 0.6], atol=1e-5) and not snapshot.warnings


def test_procedural_textures_in_space(scene):
    def shader(tree):
        checker = node(tree, "ShaderNodeTexChecker", {"Color1": (1, 0, 0, 1), "Color2": (0, 1, 0, 1), "Scale": 8.0})
        ramp = node(tree, "ShaderNodeValToRGB", {"Fac": checker.outputs["Fac"]})
        ramp.color_ramp.elements[0].color = (0, 0, 1, 1)
        mixed = node(
            tree,
            "ShaderNodeMix",
            {"Factor_Float": 0.5, "A_Color": checker.outputs["Color"], "B_Color": ramp.outputs["Color"]},
            data_type="RGBA",
        )
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": mixed.outputs[2]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    # Checker: half red, half green; the ramp turns its 1 and 0 into white and blue.
    pixels = snapshot.images[read_material.base_image].pixels[..., :3]
    assert np.allclose(pixels.mean(axis=(0, 1)), 0.5, atol=0.1) and not snapshot.warnings
    pure = np.abs(pixels - [1, 0.5, 0.5]).max(-1) < 1e-3, np.abs(pixels - [0, 0.5, 0.5]).max(-1) < 1e-3
    assert (pure[0] | pure[1]).all() and pure[0].any() and pure[1].any()


def test_a_procedural_texture_laid_out_by_uvs_keeps_its_pattern(scene):
    def shader(tree):
        coordinates = node(tree, "ShaderNodeTexCoord")
        checker = node(
            tree,
            "ShaderNodeTexChecker",
            {"Vector": coordinates.outputs["UV"], "Color1": (1, 0, 0, 1), "Color2": (0, 0, 1, 1), "Scale": 2.0},
        )
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": checker.outputs["Color"]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    pixels = snapshot.images[read_material.base_image].pixels
    edge = len(pixels)
    assert not np.allclose(pixels[edge // 4, edge // 4], pixels[edge // 4, 3 * edge // 4])
    assert np.allclose(pixels[edge // 4, edge // 4], pixels[3 * edge // 4, 3 * edge // 4])


def test_a_procedural_texture_inside_a_group(scene):
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    entry, exit_node = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    checker = node(group, "ShaderNodeTexChecker", {"Color1": entry.outputs[0], "Color2": (0, 0, 0, 1), "Scale": 8.0})
    group.links.new(checker.outputs[0], exit_node.inputs[0])
    groups_before = len(bpy.data.node_groups)

    def shader(tree):
        outer = tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = group
        outer.inputs[0].default_value = (0.6, 0.2, 0.4, 1)
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": outer.outputs[0]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    pixels = snapshot.images[read_material.base_image].pixels[..., :3]
    assert np.allclose(pixels.mean(axis=(0, 1)), [0.3, 0.1, 0.2], atol=0.06)
    assert len(bpy.data.node_groups) == groups_before and len(group.interface.items_tree) == 2


def test_an_attribute_that_is_missing_is_black_and_named(scene):
    def shader(tree):
        attribute = node(tree, "ShaderNodeVertexColor", layer_name="Paint Layer")
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": attribute.outputs["Color"]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    assert not snapshot.images[read_material.base_image].pixels[..., :3].any()
    assert warned(snapshot, "'Subject'", "'Paint Layer'", "black")


def test_what_nobody_knows_falls_back_to_the_socket_and_is_named(scene):
    def shader(tree):
        view = node(tree, "ShaderNodeCameraData", name="Far")
        return node(tree, "ShaderNodeBsdfDiffuse", {"Color": view.outputs["View Distance"]}).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    assert read_material.base_color == pytest.approx((0.8, 0.8, 0.8))
    assert warned(snapshot, "'Subject'", "'Far'", "'Color'")


def test_light_path_tricks_are_seen_by_diffuse_rays(scene):
    def shader(tree):
        path = node(tree, "ShaderNodeLightPath")
        shown = node(tree, "ShaderNodeEmission", {"Strength": 100.0})
        real = node(tree, "ShaderNodeEmission", {"Strength": 2.0})
        return node(
            tree,
            "ShaderNodeMixShader",
            {"Fac": path.outputs["Is Camera Ray"], "Shader": real.outputs[0], "Shader_001": shown.outputs[0]},
        ).outputs[0]

    assert read(scene, built(shader))[0].emission == pytest.approx((2, 2, 2))


def test_textures_with_mappings_of_their_own(scene):
    def shader(tree):
        base = textured(tree, pixels=OPAQUE)
        coordinates = node(tree, "ShaderNodeTexCoord")
        moved = node(tree, "ShaderNodeMapping", {"Vector": coordinates.outputs["UV"], "Scale": (3, 3, 3)})
        glow = node(tree, "ShaderNodeTexImage", {"Vector": moved.outputs[0]}, image=image("glow", OPAQUE))
        return node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {"Base Color": base, "Emission Color": glow.outputs["Color"], "Emission Strength": 2.0},
        ).outputs[0]

    read_material, snapshot = read(scene, built(shader))
    assert read_material.base_image != NO_IMAGE and read_material.emission == pytest.approx((2, 2, 2))
    glow = snapshot.images[read_material.emission_image].pixels[..., :3]
    assert np.allclose(glow, [0.2, 0.4, 0.6], atol=1e-4) and not snapshot.warnings


def test_unconnected_output_is_black_and_volumes_are_named(scene):
    made = bpy.data.materials.new("Fog")
    tree = with_nodes(made)
    volume = node(tree, "ShaderNodeVolumeScatter")
    node(tree, "ShaderNodeOutputMaterial", {"Volume": volume.outputs[0]})
    _, snapshot = read(scene, made)
    assert len(snapshot.triangles) == 0 and warned(snapshot, "volume", "'Fog'")


def test_warnings_are_one_line_for_many(scene):
    data = quad(uv_map="UVMap")
    place(data)
    for index in range(20):
        data.materials.append(material(f"glass {index}", "ShaderNodeBsdfPrincipled", {"Transmission Weight": 0.5}))
    lines = read_scene(scene).warnings
    assert len(lines) == 1 and "and 14 more" in lines[0]
