# SPDX-License-Identifier: GPL-3.0-or-later
"""The same furnished room at the origin, far away, tiny and huge: the same light, to half a percent."""

from functools import lru_cache

import bpy
import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.scene.read import read_scene
from gridlight.scene.volumes import create_volume
from gridlight.tests import scenes
from hard_room import difference, irradiance, room, run, textured
from mathutils import Matrix, Vector

PLACES = {
    "the origin": ((0.0, 0.0, 0.0), 1.0),
    "100 km away": ((1e5, -1e5, 1e5), 1.0),
    "1000 km away": ((1e6, 1e6, -1e6), 1.0),
    "1 cm large": ((0.0, 0.0, 0.0), 0.01 / 2.5),
    "1 cm large, 100 m away": ((128.0, -64.0, 32.0), 2.0**-8),
    "2.5 km large": ((0.0, 0.0, 0.0), 1000.0),
    "250 m large, 100 km away": ((-1e5, 0.0, 0.0), 100.0),
}
MOST = 5e-3


def furnished(offset, scale):
    """The room with pictures on walls, a slit in the ceiling for sun and sky, a glowing strip, lamps of every kind and
    a volume, all where 32 bits can say it 1000 km away. Powers of lamps go with the square of the size; radiances and
    the sun's irradiance stay."""
    scene = room(offset, scale)
    place = Matrix.Translation(Vector(offset)) @ Matrix.Scale(scale, 4)
    there = {item.name for item in scene.objects}
    pictures = bpy.data.images.new("Pictures", 64, 64)
    pictures.generated_type = "COLOR_GRID"
    walls = [item for item in scene.objects if item.type == "MESH"]
    for item in walls[::2]:
        item.data.uv_layers.new(name="UVMap")
        item.data.materials[0] = textured(pictures)
    bpy.data.objects.remove(walls[1])
    for low, high in (((-0.25, -0.25, 2.5), (1.0, 2.75, 2.75)), ((1.75, -0.25, 2.5), (2.75, 2.75, 2.75))):
        scenes.add_box(scene, "Half of the ceiling", low, high, scenes.diffuse((0.6, 0.6, 0.7)))
    glow = scenes.emitter((1.0, 0.8, 0.5), 20.0)
    scenes.add_plane(scene, "Strip", (0.5, 1.25, 2.4375), (0, 0.75, 0), (0.03125, 0, 0), glow)
    scenes.add_light(scene, "SUN", rotation=(0.3, 0.2, 0), energy=3.0, angle=0.01)
    squared = scale**2
    scenes.add_light(scene, "AREA", (2.0, 2.0, 1.5), rotation=(0.5, 0.3, 0), energy=20.0 * squared, size=0.25)
    scenes.add_light(
        scene,
        "SPOT",
        (0.5, 0.5, 2.25),
        energy=30.0 * squared,
        spot_size=1.0,
        spot_blend=0.2,
        shadow_soft_size=0.0625 * scale,
    )
    box = np.diag([1.0, 0.9, 0.95, 1.0])
    box[:3, 3] = 1.25
    create_volume(scene, "Volume", box, (4, 4, 4))
    world = bpy.data.worlds.new("Sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.3, 0.5, 0.8, 1.0)
    scene.world = world
    bpy.context.view_layer.update()
    for item in scene.objects:
        if item.name not in there:
            item.matrix_world = place @ item.matrix_basis
    bpy.context.view_layer.update()
    return scene


@lru_cache(maxsize=4)
def light_in(where, capture):
    """(N, 6, 3) irradiance at the volume's nodes and at forty places between them."""
    offset, scale = PLACES[where]
    snapshot = read_scene(furnished(offset, scale))
    (found,) = snapshot.volumes
    grid = Grid(found.matrix, found.resolution)
    result = run(snapshot, grid, capture=capture)
    assert result.converged and result.counts["active"] == grid.count and not snapshot.warnings
    inside = np.random.default_rng(0).uniform(-0.95, 0.95, (40, 3)) @ grid.matrix[:3, :3].T + grid.matrix[:3, 3]
    return irradiance(result, np.concatenate([grid.positions(), inside]))


@pytest.mark.any_version
@pytest.mark.parametrize(
    "where, capture",
    [(where, "trace") for where in PLACES if where != "the origin"]
    + [(where, "raster") for where in ("1000 km away", "1 cm large")],
)
def test_the_same_room_elsewhere_and_in_another_size(gpu_context, where, capture):
    assert difference(light_in(where, capture), light_in("the origin", capture)) < MOST


def test_both_captures_see_the_same_light(gpu_context):
    assert difference(light_in("the origin", "raster"), light_in("the origin", "trace")) < 1e-2
