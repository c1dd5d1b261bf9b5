# SPDX-License-Identifier: GPL-3.0-or-later
"""When the preview draws: draw handlers, application handlers and the timer, and how they come and go.

Only the handlers for loading files and for undo stay while the preview is off. Everything else exists from the moment
that a scene's preview is switched on, or a view is rendered by Gridlight's engine, until no view needs it any more.
"""

from __future__ import annotations

import time

import bpy
import gpu
from bpy.app.handlers import persistent

from ..gpu_shaders.viewport_pass import Probes, display
from ..gpu_shaders.viewport_shading import Shading
from . import changes, hud, points, sessions
from .view_images import ViewImages

ENGINE = "GRIDLIGHT"
_FRAME_SECONDS = 1 / 60
_IDLE_SECONDS = 0.2  # between looks whether anybody still needs a session
_PULL = 1e-3  # share of the distance by which the preview stands before what Blender drew at the same place

images = ViewImages()
_stands_still = False  # light does not follow now
_draw_handles: list[object] = []


def register() -> None:
    bpy.app.handlers.load_pre.append(_before_load)
    bpy.app.handlers.load_post.append(_after_load)
    for handlers in _history_handlers():
        handlers.append(_history_moved)
    if not bpy.app.background:
        # While an extension registers, the file's data is out of reach.
        bpy.app.timers.register(_sync_all, first_interval=0.0)


def unregister() -> None:
    if bpy.app.timers.is_registered(_sync_all):
        bpy.app.timers.unregister(_sync_all)
    stop()
    for handlers in _history_handlers():
        handlers.remove(_history_moved)
    bpy.app.handlers.load_post.remove(_after_load)
    bpy.app.handlers.load_pre.remove(_before_load)


def sync(_scene: bpy.types.Scene | None = None) -> None:
    """Makes what runs match what the scenes ask for."""
    if bpy.app.background:
        return
    points.sync()
    wanted = any(scene.gridlight.preview.enabled for scene in bpy.data.scenes)
    if wanted and not _draw_handles:
        add = bpy.types.SpaceView3D.draw_handler_add
        _draw_handles.append(add(_draw_view, (), "WINDOW", "POST_VIEW"))
        _draw_handles.append(add(_draw_hud, (), "WINDOW", "POST_PIXEL"))
        start()
    elif not wanted and _draw_handles:
        _remove_draw_handlers()
    _free_unused()
    if not wanted and not sessions.existing():
        _stop_noticing()
    _redraw_views()


def start() -> None:
    """Notices changes and works on them from now on."""
    for handlers in _change_handlers():
        if _noticed not in handlers:
            handlers.append(_noticed)
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=0.0, persistent=True)


def stop() -> None:
    """Frees everything and takes all handlers away but those for loading and undo."""
    points.stop()
    _remove_draw_handlers()
    sessions.drop_all()
    images.clear()
    _stop_noticing()


def stand_still(is_wanted: bool) -> None:
    """Until told otherwise views show what they have and what is edited, but no light follows and no picture is
    refined: a bake, whose light takes the place of that, gets the time."""
    global _stands_still
    _stands_still = images.is_rough = is_wanted


def request(scene: bpy.types.Scene) -> sessions.SceneSession:
    """The session of ``scene`` for a view that wants to draw it; it may have nothing to show yet."""
    session = sessions.session_of(scene)
    start()
    return session


def shading_of(preview) -> tuple[Shading, Probes | None]:
    """What ``preview`` (the scene's property group) asks to be drawn."""
    shading = Shading(preview.mode, preview.indirect, preview.highlight, preview.probe_shading)
    return shading, Probes(preview.probe_size) if preview.show_probes else None


# Drawing
# ----------------------------------------------------------------------------------------------------------------------


def _draw_view() -> None:
    """POST_VIEW: the scene in light, over what Blender drew, where nothing of Blender's stands before it."""
    context = bpy.context
    preview = context.scene.gridlight.preview
    if not preview.enabled or is_engine_view(context):
        return
    session = request(context.scene)
    if session.gpu is None:
        return
    before = _state()
    shading, probes = shading_of(preview)
    # A black world would hide the grid and the theme's backdrop and show nothing instead.
    backdrop = session.gpu.drawing.world_shines
    started = time.perf_counter()
    picture, _ = images.draw(context, session, shading, probes, backdrop)
    session.readout.frame(time.perf_counter() - started)
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    gpu.state.blend_set("ALPHA_PREMULT")
    settings = context.scene.view_settings
    display(
        picture,
        "OVERLAY",
        exposure=(settings.exposure + preview.exposure) if shading.shows_amounts else 0.0,
        tone_curve=preview.tone_curve if shading.shows_amounts else "STANDARD",
        gamma=settings.gamma if shading.shows_amounts else 1.0,
        depth_scale_offset=_pulled_depth(context.region_data),
    )
    _restore(before)


def _draw_hud() -> None:
    """POST_PIXEL: the readout."""
    context = bpy.context
    preview = context.scene.gridlight.preview
    if preview.enabled and not is_engine_view(context):
        hud.draw(context, sessions.session_of(context.scene), preview)


def is_engine_view(context: bpy.types.Context) -> bool:
    """Whether Gridlight's render engine draws this view itself."""
    return context.space_data.shading.type == "RENDERED" and context.scene.render.engine == ENGINE


def _state() -> tuple:
    return gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get()


def _restore(state: tuple) -> None:
    gpu.state.blend_set(state[0])
    gpu.state.depth_test_set(state[1])
    gpu.state.depth_mask_set(state[2])
    gpu.state.face_culling_set("NONE")
    gpu.state.color_mask_set(True, True, True, True)


def _pulled_depth(region_3d: bpy.types.RegionView3D) -> tuple[float, float]:
    """Scale and offset of depth values (0..1) that bring points nearer by _PULL of their distance; in parallel views by
    _PULL of the view's height."""
    window = region_3d.window_matrix
    if region_3d.is_perspective:
        scale = 1 / (1 - _PULL)
        return scale, 0.5 * (scale - 1) * (window[2][2] - 1)
    return 1.0, -0.5 * abs(window[2][2]) * _PULL * 2 / window[1][1]


# Time
# ----------------------------------------------------------------------------------------------------------------------


def _tick() -> float | None:
    """The timer: reads what changed, lets light follow, and asks for redraws. Ends itself when nobody looks."""
    _free_unused()
    if not sessions.existing() and not _draw_handles:
        _stop_noticing()
        return None
    busy = False
    for session in sessions.existing():
        scene = session.scene
        version = session.version
        session.update(scene, _view_layer(scene))
        preview = scene.gridlight.preview
        if preview.live and preview.enabled and not _stands_still:
            session.relight(scene, _left_for_light(preview.frame_budget_ms / 1000, session))
            busy |= session.is_relighting
        busy |= session.is_pending
        settings = _shown_settings(scene)
        if session.version != version or session.shown_settings != settings:
            session.shown_settings = settings
            _redraw_views(scene)
            busy = True
    images.keep_only([area for area, _ in _views()])
    drawable = {session.scene for session in sessions.existing() if session.gpu is not None}
    for area, scene in _views():
        if scene in drawable and images.needs_drawing(area):
            area.tag_redraw()
            busy = True
    return _FRAME_SECONDS if busy else _IDLE_SECONDS


def _left_for_light(frame_seconds: float, session: sessions.SceneSession) -> float:
    """Of a frame, what drawing leaves; half of it where drawing takes more."""
    return max(frame_seconds - session.readout.draw_seconds, frame_seconds / 2)


def _shown_settings(scene: bpy.types.Scene) -> tuple:
    """What decides how a picture looks besides what is in it: scripts that set it do not make Blender redraw."""
    preview, view = scene.gridlight.preview, scene.view_settings
    return *shading_of(preview), preview.exposure, preview.tone_curve, view.exposure, view.gamma


def _views():
    """Yields (3D viewport area, its scene) of all windows."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                yield area, window.scene


def _redraw_views(scene: bpy.types.Scene | None = None) -> None:
    for area, shown in _views():
        if scene is None or shown == scene:
            area.tag_redraw()


def _view_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer that a window shows; the first where none does."""
    shown = (window.view_layer for window in bpy.context.window_manager.windows if window.scene == scene)
    return next(shown, scene.view_layers[0])


def _free_unused() -> None:
    """Drops sessions of scenes that are gone or that no view shows in Gridlight's light."""
    rendered = {
        scene
        for area, scene in _views()
        if area.spaces.active.shading.type == "RENDERED" and scene.render.engine == ENGINE
    }
    for session in sessions.existing():
        scene = session.scene
        if scene is None or not (scene.gridlight.preview.enabled or scene in rendered):
            sessions.drop(session)
    if not sessions.existing():
        images.clear()


def _remove_draw_handlers() -> None:
    while _draw_handles:
        bpy.types.SpaceView3D.draw_handler_remove(_draw_handles.pop(), "WINDOW")


def _stop_noticing() -> None:
    for handlers in _change_handlers():
        if _noticed in handlers:
            handlers.remove(_noticed)
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)


# Application handlers
# ----------------------------------------------------------------------------------------------------------------------


def _change_handlers() -> tuple[list, ...]:
    return (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post)


def _history_handlers() -> tuple[list, ...]:
    return bpy.app.handlers.undo_post, bpy.app.handlers.redo_post


@persistent
def _noticed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    for session in sessions.existing():
        if session.scene == scene:
            session.mark(changes.kinds_of(depsgraph))


@persistent
def _history_moved(_scene, _depsgraph=None) -> None:
    for session in sessions.existing():
        session.mark({changes.SURFACES, changes.FIELDS})
    sync()  # whether previews are on is undone like everything else


@persistent
def _before_load(_path) -> None:
    stop()


@persistent
def _after_load(_path) -> None:
    sync()


def _sync_all() -> None:
    """Once after registering, as a timer."""
    sync()
