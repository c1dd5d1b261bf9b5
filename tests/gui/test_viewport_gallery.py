# SPDX-License-Identifier: GPL-3.0-or-later
"""The gallery, baked and shown: the screen shows what preview.png would, pixel by pixel."""

import bpy
import lit_room
import numpy as np
from harness import in_blender


@in_blender(backends=("opengl",), timeout=300.0)
def test_gallery_on_the_screen_is_the_traced_picture(person):
    person.module("viewport.view_images").SAMPLES = 8
    bpy.ops.wm.read_homefile(use_empty=True)
    yield 0.5
    scene = person.module("scene.gallery").build_gallery(bpy.context.scene)
    scene.gridlight.preview.live = False
    scene.camera.data.show_passepartout = False
    yield 0.3
    person.do("gridlight.bake")
    space = person.area().spaces.active
    space.overlay.show_overlays = space.show_gizmo = space.show_region_ui = space.show_region_toolbar = False
    space.show_region_header = space.show_region_tool_header = False
    space.region_3d.view_perspective = "CAMERA"
    space.region_3d.view_camera_zoom = 30.0
    scene.gridlight.preview.enabled = True
    yield from lit_room.drawn(person, 120.0)
    person.picture("gallery", person.rectangle())
    seen = person.look()
    place = person.rectangle()
    seen = seen[place.y : place.y + place.height, place.x : place.x + place.width][::-1] / 255.0

    step = 3  # a ninth of the pixels is enough to compare, and takes a ninth of the time
    size = -(-place.width // step), -(-place.height // step)
    region_3d = space.region_3d
    view = person.module("core.view").View.from_matrices(
        np.array(region_3d.view_matrix), np.array(region_3d.window_matrix)
    )
    session = person.module("viewport.sessions").existing()[0]
    snapshot, fields = session.snapshot, list(session.gpu.fields.values())
    textures = person.module("gpu_shaders.scene_textures").SceneTextures(
        snapshot, session.gpu.origin, np.zeros(len(snapshot.triangles))
    )
    pictures = person.module("gpu_shaders.preview_pass").PreviewPass(
        snapshot, textures, fields[0].field, session.gpu.origin
    )
    traced, _ = pictures.render(view.camera, *size, 8)
    traced = person.module("core.display").standard_view(traced[..., :3], 0.0)
    height, width = (seen.shape[0] // step) * step, (seen.shape[1] // step) * step
    coarse = seen[:height, :width].reshape(height // step, step, width // step, step, 3).mean(axis=(1, 3))
    difference = np.abs(coarse - traced[: height // step, : width // step])
    assert coarse.std() > 0.1
    assert difference.mean() < 0.012, difference.mean()
    assert (difference.max(axis=2) < 0.08).mean() > 0.97, np.percentile(difference, [90, 97, 99])
    scene.gridlight.preview.enabled = False
