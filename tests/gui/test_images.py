# SPDX-License-Identifier: GPL-3.0-or-later
"""Every mode of the preview, Explore mode and the report beside the pictures of them that are kept in tests/images, on
both backends; and one picture, whether draw handler, render engine or the pictures of the command line draw it."""

import bpy
import lit_room
import numpy as np
import reference
from harness import in_blender

MODES = ("FULL", "DIRECT", "INDIRECT", "IRRADIANCE", "NORMALS", "VALIDITY", "ERROR")


def build(person):
    """A room with things in it and a field that is known: brighter and redder to one side, from above, with a culled
    and an invalid probe."""
    volume = lit_room.build(person, lamp=True)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (-0.8, 0.3, 2.2), 160, 0.05
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.7, location=(0.9, 0.4, -0.6), segments=24, ring_count=12)
    bpy.ops.object.shade_smooth()
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(-0.9, -0.5, -1.2), rotation=(0, 0, 0.5))
    bpy.ops.object.select_all(action="DESELECT")
    person.window.view_layer.update()
    box, counts = person.module("scene.volumes").box_of(volume), person.module("scene.volumes").resolution_of(volume)
    grid = person.module("core.grid").Grid(box, counts, volume.name)
    field = person.module("core.field").Field.empty(grid, 3)
    x, y, z = (grid.positions() / 2.5).T
    warm = np.stack([0.5 + 0.4 * x, 0.4 + 0.1 * x * y, 0.35 - 0.25 * x], axis=1)
    field.coefficients[:, 0] = warm * np.sqrt(4 * np.pi)
    field.coefficients[:, 2] = 0.4 * warm * (1 + 0.5 * z)[:, None]
    field.depth[..., :2] = 100.0, 10000.0
    field.validity[:] = 0.6 + 0.4 * z
    conventions = person.module("core.conventions")
    field.state[4], field.state[22] = conventions.CULLED, conventions.INVALID
    person.module("scene.field_storage").store_field(volume, field, "known light")
    person.module("viewport").field_changed(volume)
    space = lit_room.view(person, distance=3.4, rotation=(0.78, 0.52, 0.19, 0.28))
    space.show_region_header = space.show_region_tool_header = False
    scene = bpy.context.scene
    scene.view_settings.view_transform = "Standard"
    scene.gridlight.preview.live = False
    person.module("viewport.view_images").SAMPLES = 4
    return space


def seen(person):
    return reference.coarse(person.look(person.rectangle()))


@in_blender(timeout=180.0)
def test_modes_are_like_their_pictures(person):
    build(person)
    preview = bpy.context.scene.gridlight.preview
    preview.enabled = True
    problems = []
    for name in (*MODES, "probes", "radiance"):
        preview.mode = name if name in MODES else "FULL"
        preview.show_probes, preview.probe_size = name not in MODES, 0.25
        preview.probe_shading = "RADIANCE" if name == "radiance" else "IRRADIANCE"
        yield from lit_room.drawn(person)
        try:
            reference.check(f"preview_{name.lower()}", seen(person))
        except AssertionError as error:
            problems.append(str(error))
    preview.enabled = preview.show_probes = False
    assert not problems, "\n".join(problems)


@in_blender(timeout=180.0)
def test_engine_and_command_line_draw_the_same_picture(person):
    """All three ways against the one picture that is kept."""
    space = build(person)
    scene = bpy.context.scene
    scene.render.engine = "GRIDLIGHT"
    space.shading.type = "RENDERED"
    yield from lit_room.drawn(person)
    engine = seen(person)
    session = person.module("viewport.sessions").existing()[0]
    snapshot, field = session.snapshot, next(iter(session.gpu.fields.values())).field
    origin = session.gpu.origin
    textures = person.module("gpu_shaders.scene_textures").SceneTextures(
        snapshot, origin, np.zeros(len(snapshot.triangles))
    )
    region_3d = space.region_3d
    view = person.module("core.view").View.from_matrices(
        np.array(region_3d.view_matrix), np.array(region_3d.window_matrix)
    )
    height, width = engine.shape[:2]
    pictures = person.module("gpu_shaders.preview_pass").PreviewPass(snapshot, textures, field, origin)
    traced, _ = pictures.render(view.camera, width, height, 4)
    traced = person.module("core.display").standard_view(traced[::-1, :, :3], 0.0)
    space.shading.type = "SOLID"
    scene.render.engine = "BLENDER_EEVEE"
    sessions = person.module("viewport.sessions")
    yield from person.wait_until(lambda: not sessions.existing(), "the end of a session that nobody needs")
    yield 0.3
    if not reference.is_blessing():
        reference.check("preview_full", engine)
        reference.check("preview_full", traced)


@in_blender(timeout=180.0)
def test_explore_mode_is_like_its_picture(person):
    """The list of keys over the light, from where the view stood."""
    build(person)
    person.move(*person.rectangle().center)  # where keys are pressed: the mouse turns the view
    yield 0.5
    assert person.do("gridlight.explore", invoke=True) == {"RUNNING_MODAL"}
    try:
        yield from lit_room.drawn(person)
        explore = person.module("operators.explore")._running[0]
        yield from person.key("F1")
        yield from person.wait_until(lambda: explore._overlay.help_is_open, "the list of keys")
        yield from person.wait_until(lambda: not explore._overlay.is_fading, "the end of the first words")
        yield from lit_room.drawn(person)
        person.picture("help", person.rectangle())
        reference.check("explore_help", seen(person))
        yield from person.key("Escape")
    finally:
        person.module("operators.explore").stop_running()


@in_blender(backends=("opengl",), timeout=180.0)
def test_report_panel_is_like_its_picture(person):
    build(person)
    volume = bpy.data.objects["Room"]
    storage = person.module("scene.field_storage")
    field = storage.load_field(volume)
    field.metadata |= {
        "converged": True,
        "scene": {"frame": 1},
        "warnings": ["glass lets light through unbent: 'Pane'"],
    }
    seconds = {"read": 0.02, "cull": 0.01, "capture": 0.42, "light": 0.31}
    storage.store_field(volume, field, "known light", {"seconds": seconds, "bounces": 8})
    yield from person.open_tab()
    yield from person.only_panel("Report")
    person.move(3, 3)
    yield from person.settle()
    sidebar = person.rectangle(person.region("UI"))
    person.picture("report", sidebar)
    reference.check("report_panel", reference.coarse(person.look(sidebar)))
