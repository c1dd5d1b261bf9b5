# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering with the engine "Gridlight": scene-linear light in the image, as closed forms and preview.png have it."""

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.core.display import standard_view
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.gpu_shaders.preview_pass import PreviewPass
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.scene.field_storage import store_field
from gridlight.scene.read import read_scene
from gridlight.scene.volumes import box_of, create_volume, resolution_of

RADIANCE, ALBEDO = 0.4, (0.8, 0.5, 0.25)


@pytest.fixture
def scene():
    """A 6 m room with a uniform field, a camera inside, and the extension registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    gridlight.register()
    bpy.ops.mesh.primitive_cube_add(size=6.0)
    material = bpy.data.materials.new("room")
    material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"].inputs
    principled["Base Color"].default_value = (*ALBEDO, 1.0)
    principled["Specular IOR Level"].default_value = 0.0  # what it mirrors is spread as well and would add to ALBEDO
    bpy.context.object.data.materials.append(material)
    scene = bpy.context.scene
    volume = create_volume(scene, "Room", np.diag([2.5, 2.5, 2.5, 1.0]), (3, 3, 3))
    bpy.context.view_layer.update()
    field = Field.empty(Grid(box_of(volume), resolution_of(volume), "Room"), 2)
    field.coefficients[:, 0] = RADIANCE * np.sqrt(4 * np.pi)
    field.depth[..., :2] = 100.0, 10000.0
    store_field(volume, field, "known light")
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (-2.0, -2.0, 0.5), (1.4, 0.1, -0.7)
    scene.render.engine = "GRIDLIGHT"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 64, 36, 100
    yield scene
    gridlight.unregister()


def rendered(scene, folder):
    """(height, width, 4) scene-linear pixels of a render, through a file as users get it."""
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = str(folder / "picture.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def test_image_holds_albedo_times_radiance(scene, tmp_path):
    pixels = rendered(scene, tmp_path)
    assert pixels.shape == (36, 64, 4)
    np.testing.assert_allclose(pixels[..., :3], np.broadcast_to(np.array(ALBEDO) * RADIANCE, (36, 64, 3)), rtol=1e-3)
    np.testing.assert_allclose(pixels[..., 3], 1.0)


def add_lamp(scene):
    data = bpy.data.lights.new("lamp", "POINT")
    data.energy, data.shadow_soft_size = 150.0, 0.2
    lamp = bpy.data.objects.new("lamp", data)
    lamp.location = (0.5, 1.0, 1.8)
    scene.collection.objects.link(lamp)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.3, 0.4, -2.2))


def test_same_picture_as_the_traced_one(scene, tmp_path):
    """A lamp, its soft shadow and its highlight; lens shift is the render's own business and tested by the view."""
    add_lamp(scene)
    pixels = rendered(scene, tmp_path)
    snapshot = read_scene(scene)
    field = Field.empty(Grid(np.diag([2.5, 2.5, 2.5, 1.0]), (3, 3, 3)), 2)
    field.coefficients[:, 0] = RADIANCE * np.sqrt(4 * np.pi)
    field.depth[..., :2] = 100.0, 10000.0
    origin = field.grid.center
    textures = SceneTextures(snapshot, origin, np.zeros(len(snapshot.triangles)))
    traced, _ = PreviewPass(snapshot, textures, field, origin).render(snapshot.camera, 64, 36, 32)
    difference = np.abs(standard_view(pixels[..., :3], 0.0) - standard_view(traced[..., :3], 0.0))
    assert pixels[..., :3].std() > 0.05
    assert difference.mean() < 0.01
    assert (difference.max(axis=2) < 0.05).mean() > 0.97


def test_border_is_the_same_part_of_the_image(scene, tmp_path):
    add_lamp(scene)
    whole = rendered(scene, tmp_path)
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    part = rendered(scene, tmp_path)
    assert part.shape == (18, 32, 4)
    np.testing.assert_allclose(part, whole[18:, 16:48], rtol=1e-4, atol=1e-5)


def test_shifted_and_parallel_cameras(scene, tmp_path):
    """A small lit square in front of a black room lands where the camera's frame says."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_plane_add(size=0.2, location=(0, 0, 0))
    camera = scene.camera
    camera.location, camera.rotation_euler = (0, 0, 2.0), (0, 0, 0)
    for kind in ("PERSP", "ORTHO"):
        camera.data.type, camera.data.ortho_scale = kind, 2.0
        camera.data.shift_x, camera.data.shift_y = 0.2, -0.1
        seen = rendered(scene, tmp_path)[..., :3].sum(axis=2) > 0
        rows, columns = np.nonzero(seen)
        # A shift of 1 moves the picture by its width; the square goes the other way.
        assert abs(columns.mean() + 0.5 - (32 - 0.2 * 64)) < 1.0, (kind, columns.mean())
        assert abs(rows.mean() + 0.5 - (18 + 0.1 * 64)) < 1.0, (kind, rows.mean())


def test_scenes_without_surface_or_camera_say_so(scene, tmp_path, capfd):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    assert not rendered(scene, tmp_path)[..., :3].any()
    bpy.data.objects.remove(scene.camera)
    with pytest.raises(RuntimeError, match="[Cc]amera"):
        bpy.ops.render.render()


def test_panels_of_lights_materials_and_output_are_there_with_the_engine(scene):
    def shown():
        panels = ("DATA_PT_EEVEE_light", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface", "RENDER_PT_format")
        return [
            "GRIDLIGHT" in getattr(getattr(bpy.types, name), "COMPAT_ENGINES", ())
            for name in panels
            if hasattr(bpy.types, name)
        ]

    assert len(shown()) >= 3 and all(shown())
    gridlight.unregister()
    assert not any(shown())
    gridlight.register()
