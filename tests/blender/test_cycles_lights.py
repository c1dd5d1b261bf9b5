# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of light against Cycles: what one probe sees of a wall that only this light shines on.

One bounce on both sides: the probe's texels hold emission plus reflected direct light, Cycles stops at the first hit.
The lights stand behind the probe and a small screen before them casts a shadow on the wall, so the size and shape of a
light matter and not only its power. The wall fills the view and the probe sees only the dark side of the screen: no
silhouette of anything lit is in sight, whose aliasing would be an error of texels and not of lights. The comparison is
of all coefficients of four bands, and of the mean radiance (band 0) alone.
"""

import bpy
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.core import measures
from gridlight.core.grid import Grid
from gridlight.core.panorama import project_panorama
from gridlight.core.settings import BakeSettings
from gridlight.tests import scenes

PROBE = np.array([0.1, 0.4, -0.1])
FACING_WALL = (np.pi / 2, 0.0, 0.0)  # rotation that shines along +Y
SLANTED = (np.pi / 2 - 0.25, 0.0, 0.3)
BEHIND = (0.3, -0.9, 0.5)
WALL = 20.0  # metres, half edge: as good as endless
TOLERANCE = 0.01
NOISE = 0.003  # of the reference, which must stay far below the tolerance
# Fine texels: the edge of a sharp shadow is an error of texels too.
SETTINGS = BakeSettings(bands=4, face=128, samples=16, bounces=0, keep_all=True)

LIGHTS = {
    "point": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.0),
    "point, coloured": dict(kind="POINT", location=BEHIND, energy=50, color=(1.0, 0.5, 0.2), shadow_soft_size=0.0),
    "point, soft": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.3, use_soft_falloff=True),
    "point, sphere": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.3, use_soft_falloff=False),
    "point, not normalized": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.3, normalize=False),
    "point, sharp, not normalized": dict(
        kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.0, normalize=False
    ),
    "point, scaled": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.2, scale=(2.0, 2.0, 2.0)),
    "point, no shadow": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.0, use_shadow=False),
    "spot": dict(
        kind="SPOT",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shadow_soft_size=0.0,
        spot_size=1.2,
        spot_blend=0.0,
        use_shadow=False,
    ),
    "spot, blend": dict(
        kind="SPOT",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shadow_soft_size=0.0,
        spot_size=1.4,
        spot_blend=0.6,
        use_shadow=False,
    ),
    "spot, soft": dict(
        kind="SPOT", location=BEHIND, rotation=SLANTED, energy=50, shadow_soft_size=0.2, spot_size=1.2, spot_blend=0.3
    ),
    "spot, sphere": dict(
        kind="SPOT",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shadow_soft_size=0.2,
        spot_size=1.2,
        spot_blend=0.3,
        use_soft_falloff=False,
    ),
    "spot, scaled": dict(
        kind="SPOT",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shadow_soft_size=0.0,
        spot_size=1.0,
        spot_blend=0.5,
        scale=(1.0, 2.0, 0.7),
    ),
    "sun": dict(kind="SUN", rotation=SLANTED, energy=3.0, angle=0.0),
    "sun, angle": dict(kind="SUN", rotation=SLANTED, energy=3.0, angle=0.3),
    "sun, wide": dict(kind="SUN", rotation=SLANTED, energy=3.0, angle=2.0),
    "sun, not normalized": dict(kind="SUN", rotation=SLANTED, energy=3.0, angle=0.5, normalize=False),
    "area, square": dict(kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="SQUARE", size=0.5),
    "area, rectangle": dict(
        kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="RECTANGLE", size=0.8, size_y=0.2
    ),
    "area, disk": dict(kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="DISK", size=0.5),
    "area, ellipse": dict(
        kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="ELLIPSE", size=0.8, size_y=0.3
    ),
    "area, scaled": dict(
        kind="AREA",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shape="RECTANGLE",
        size=0.4,
        size_y=0.2,
        scale=(1.5, 2.5, 1.0),
    ),
    "area, spread": dict(
        kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="SQUARE", size=0.5, spread=1.2
    ),
    "area, narrow spread": dict(
        kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="DISK", size=0.4, spread=0.3
    ),
    "area, not normalized": dict(
        kind="AREA", location=BEHIND, rotation=SLANTED, energy=50, shape="SQUARE", size=0.5, normalize=False
    ),
    "area, near the probe": dict(
        kind="AREA", location=(0.4, 0.2, 0.9), rotation=FACING_WALL, energy=20, shape="SQUARE", size=0.6
    ),
    "exposure": dict(kind="POINT", location=BEHIND, energy=50, shadow_soft_size=0.0, exposure=1.5),
    "temperature": dict(
        kind="AREA",
        location=BEHIND,
        rotation=SLANTED,
        energy=50,
        shape="SQUARE",
        size=0.5,
        use_temperature=True,
        temperature=3200.0,
    ),
}


def wall_and_screen(name, half_edge=WALL):
    """A wall at y = 1.6 that fills the view and, behind the probe, a screen without thickness that faces the lights."""
    scene = scenes.new_scene(name)
    white = scenes.diffuse((0.8, 0.8, 0.8))
    scenes.add_plane(scene, "Wall", (0, 1.6, 0), (half_edge, 0, 0), (0, 0, half_edge), white)
    scenes.add_plane(scene, "Screen", (0.2, -0.3, 0.4), (0.2, 0, 0), (0, 0, 0.15), white)
    return scene


def probe_and_reference(scene, samples):
    """Four-band coefficients (16, 3) of the probe and of two Cycles panoramas with different seeds."""
    from gridlight.scene.cycles_reference import render_panoramas
    from gridlight.scene.read import read_scene

    grid = Grid.from_bounds(PROBE - 0.5, PROBE + 0.5, (1, 1, 1))
    result = run_bake(BakeJob(read_scene(scene), grid, SETTINGS), Reporter(quiet=True), lambda: False)
    references = [
        project_panorama(render_panoramas(scene, PROBE, 256, 128, samples, seed, bounces=0)[0], 4) for seed in (1, 2)
    ]
    return result.field.coefficients[0], references


def check(scene, samples=16):
    baked, references = probe_and_reference(scene, samples)
    reference = np.mean(references, axis=0)
    noise = measures.noise_of_mean(references[0][None], references[1][None])
    error = measures.compare(baked[None], reference[None]).relative_rms
    mean = np.linalg.norm(baked[0] - reference[0]) / np.linalg.norm(reference[0])
    print(
        f"all coefficients {100 * error:.3f} %, band 0 {100 * mean:.3f} %, noise of the reference {100 * noise:.3f} %"
    )
    assert noise < NOISE
    assert mean < TOLERANCE
    assert error < TOLERANCE


# Of each kind what Blender's versions store in another way; the others differ in numbers only.
STORED = ("point", "point, not normalized", "spot, scaled", "sun, angle", "area, ellipse", "exposure", "temperature")
# These go through nothing that others do not: a colour ("temperature"), no radius and no norm ("point, not
# normalized"), a wider sun ("sun, angle"), a spot without blend ("spot, blend").
SELDOM = ("point, coloured", "point, sharp, not normalized", "sun, wide", "spot")
ONCE = [pytest.mark.any_version]
CASES = [
    pytest.param(name, marks=[] if name in STORED else [pytest.mark.nightly] if name in SELDOM else ONCE)
    for name in LIGHTS
]


@pytest.mark.parametrize("name", CASES)
def test_light_on_a_wall(gpu_context, name):
    scene = wall_and_screen(name)
    scenes.add_light(scene, **LIGHTS[name])
    check(scene)


IES = "IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 7 1 1 2 0 0 0\n1 1 100\n0 15 30 45 60 75 90\n0\n1000 950 700 300 80 10 0\n"


def with_nodes(lamp, kind, **inputs):
    """The strength of ``lamp`` comes from a node of ``kind``; returns it."""
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    tree.nodes.clear()
    node, glow, out = (tree.nodes.new(name) for name in (kind, "ShaderNodeEmission", "ShaderNodeOutputLight"))
    tree.links.new(glow.outputs[0], out.inputs["Surface"])
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node, glow.inputs["Strength"], tree.links


@pytest.mark.parametrize("output", ["Linear", pytest.param("Constant", marks=pytest.mark.nightly)])
@pytest.mark.any_version
def test_falloff_of_a_lamp(gpu_context, output):
    scene = wall_and_screen(output)
    lamp = scenes.add_light(scene, "POINT", BEHIND, energy=20, shadow_soft_size=0.1)
    falloff, strength, links = with_nodes(lamp, "ShaderNodeLightFalloff", Strength=1.0)
    links.new(falloff.outputs[output], strength)
    check(scene)


@pytest.mark.nightly  # the lamp with a profile is measured by Cycles in the same way
def test_lamp_that_shines_to_one_side(gpu_context):
    scene = wall_and_screen("Side")
    lamp = scenes.add_light(scene, "POINT", BEHIND, SLANTED, energy=20, shadow_soft_size=0.1)
    direction, strength, links = with_nodes(lamp, "ShaderNodeTexCoord")
    side = strength.node.id_data.nodes.new("ShaderNodeSeparateXYZ")
    links.new(direction.outputs["Normal"], side.inputs[0])
    links.new(side.outputs["Y"], strength)  # negative on the other side, as in Cycles
    check(scene)


def test_ies_profile_of_a_tilted_lamp(gpu_context):
    scene = wall_and_screen("IES")
    lamp = scenes.add_light(scene, "POINT", BEHIND, SLANTED, energy=20, shadow_soft_size=0.02)
    profile, strength, links = with_nodes(lamp, "ShaderNodeTexIES")
    profile.mode, profile.ies = "INTERNAL", bpy.data.texts.new("profile")
    profile.ies.write(IES)
    links.new(profile.outputs[0], strength)
    check(scene)


@pytest.mark.any_version
def test_light_on_a_wall_two_kilometres_wide(gpu_context):
    scene = wall_and_screen("Huge", half_edge=1000.0)
    scenes.add_light(scene, "POINT", BEHIND, energy=50, shadow_soft_size=0.3)
    check(scene)


@pytest.mark.any_version
def test_light_scales_with_negative_power(gpu_context):
    """A lamp with negative power takes exactly the light away that it would give."""
    fields = []
    for sign in (1, -1):
        scene = wall_and_screen("Negative")
        scenes.add_light(scene, "POINT", (-0.6, -0.2, 0.2), energy=80, shadow_soft_size=0.0)
        scenes.add_light(scene, "POINT", BEHIND, energy=sign * 20, shadow_soft_size=0.0)
        fields.append(probe_and_reference(scene, 4))
    for baked, references in fields:
        assert measures.compare(baked[None], references[0][None]).relative_rms < TOLERANCE


def test_emissive_surface(gpu_context):
    """Seen directly; its light on other surfaces is a bounce of the bake."""
    scene = scenes.new_scene("Emissive")
    scenes.add_plane(scene, "Wall", (0, 1.6, 0), (WALL, 0, 0), (0, 0, WALL), scenes.emitter((1.0, 0.6, 0.3), 5.0))
    check(scene)


def test_emission_of_principled(gpu_context):
    """Colour × strength is radiance, whatever the base colour is."""
    scene = scenes.new_scene("Principled emission")
    wall = scenes.add_plane(scene, "Wall", (0, 1.6, 0), (WALL, 0, 0), (0, 0, WALL), scenes.diffuse((0, 0, 0)))
    material = wall.data.materials[0]
    shader = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (0, 0, 0, 1)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    shader.inputs["Emission Color"].default_value = (0.2, 0.5, 1.0, 1.0)
    shader.inputs["Emission Strength"].default_value = 7.0
    output = next(node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL")
    material.node_tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    check(scene)


def test_world_colour(gpu_context):
    """Seen past the wall's edges only: lit by the world, the wall itself needs a bounce that this bake leaves out."""
    baked, references = probe_and_reference(_black_wall("World", (0.4, 0.7, 1.3)), 4)
    assert measures.compare(baked[None], references[0][None]).relative_rms < TOLERANCE


def test_environment_texture(gpu_context):
    """A turned, strongly directional HDRI arrives from where Cycles sees it."""
    scene = _black_wall("HDRI", (0, 0, 0))
    height = 32
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height), indexing="ij")
    pixels = np.ones((height, 2 * height, 4), np.float32)
    pixels[..., 0] = 0.2 + 3 * np.exp(-((u - 0.3) ** 2 + (v - 0.7) ** 2) / 0.01)
    pixels[..., 1] = 0.3 + v
    pixels[..., 2] = 0.5 + 0.5 * np.sin(2 * np.pi * u)
    image = bpy.data.images.new("HDRI", 2 * height, height, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(pixels.ravel())
    tree = scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    mapping.inputs["Rotation"].default_value = (0.3, 0.2, 0.9)
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.7
    baked, references = probe_and_reference(scene, 16)
    assert measures.compare(baked[None], references[0][None]).relative_rms < TOLERANCE


def _black_wall(name, world):
    scene = scenes.new_scene(name, world)
    scenes.add_plane(scene, "Wall", (0, 1.6, 0), (WALL, 0, 0), (0, 0, WALL), scenes.diffuse((0, 0, 0)))
    return scene
