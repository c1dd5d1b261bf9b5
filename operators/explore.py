# SPDX-License-Identifier: GPL-3.0-or-later
"""Explore mode: walk through the light and play with it, with the keys of the 2007 sample."""

from __future__ import annotations

import contextlib
import math
import time

import bpy
import numpy as np

from . import explore_actions as actions
from . import names
from .volume_choice import in_object_mode

_TURN_PER_PIXEL = math.radians(0.15)
_TIMER_SECONDS = 1 / 60
_RUN = 4.0  # times walking speed
_WALK_SECONDS = 12.0  # to cross the scene
_EXPOSURE_STEP = 0.25

# Key: (ahead, right, up)
_MOVES = {
    "W": (1, 0, 0),
    "S": (-1, 0, 0),
    "A": (0, -1, 0),
    "D": (0, 1, 0),
    "UP_ARROW": (1, 0, 0),
    "DOWN_ARROW": (-1, 0, 0),
    "LEFT_ARROW": (0, -1, 0),
    "RIGHT_ARROW": (0, 1, 0),
    "Q": (0, 0, -1),
    "E": (0, 0, 1),
}
_GROUP_KEYS = {
    "ONE": ("CEILING_1", False),
    "TWO": ("CEILING_1", True),
    "THREE": ("CEILING_2", False),
    "FOUR": ("CEILING_2", True),
    "FIVE": ("WALL", False),
    "SIX": ("WALL", True),
    "SEVEN": ("DYNAMIC", False),
    "EIGHT": ("DYNAMIC", True),
}
_NUMPAD = {f"NUMPAD_{number}": name for number, name in enumerate(("ONE", "TWO", "THREE", "FOUR", "FIVE"), 1)}
_NUMPAD |= {f"NUMPAD_{number}": name for number, name in enumerate(("SIX", "SEVEN", "EIGHT", "NINE"), 6)}
_SAME_KEY = {**_NUMPAD, "NUMPAD_MINUS": "MINUS", "NUMPAD_PLUS": "PLUS", "EQUAL": "PLUS"}

_running: list[GRIDLIGHT_OT_explore] = []


class GRIDLIGHT_OT_explore(bpy.types.Operator):
    """Walk through the scene in its light: WASD and mouse, F1 lists the keys, Esc leaves"""

    bl_idname = names.EXPLORE
    bl_label = "Explore"
    bl_options = {"REGISTER", "UNDO", "GRAB_CURSOR", "BLOCKING"}

    @classmethod
    def poll(cls, context):
        if context.area is None or context.area.type != "VIEW_3D":
            cls.poll_message_set("Explore mode starts in a 3D viewport; press its button there")
            return False
        return in_object_mode(cls, context)

    def invoke(self, context, event):
        from ..viewport import walk  # draws, so only where there is a view
        from ..viewport.explore_overlay import ExploreOverlay

        if _running:
            self.report({"INFO"}, "Explore mode is running already")
            return {"CANCELLED"}
        space = context.space_data
        region_3d = space.region_3d
        self._scene, self._area, self._manager = context.scene, context.area, context.window_manager
        self._preview = context.scene.gridlight.preview
        self._was_enabled = self._preview.enabled
        self._preview.enabled = True
        self._walker = walk.Walker(space, region_3d, _walking_speed(context.scene))
        self._overlay = ExploreOverlay()
        self._overlay.say(f"F1: help   Esc: leave   {self._walker.speed:.1f} m/s")
        self._drawing = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), "WINDOW", "POST_PIXEL")
        self._animation = actions.Animation(context.scene)
        self._held: set[str] = set()
        self._runs = False
        self._wall = -1
        self._moment = time.perf_counter()
        self._timer = self._manager.event_timer_add(_TIMER_SECONDS, window=context.window)
        self._manager.modal_handler_add(self)
        _running.append(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if self not in _running:  # stopped from outside
            return {"CANCELLED"}
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self._end()
            return {"FINISHED"}
        if event.type.startswith("TIMER"):
            self._step()
            return {"PASS_THROUGH"}  # playback has a timer of its own
        if event.type in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            turn = event.mouse_x - event.mouse_prev_x, event.mouse_y - event.mouse_prev_y
            self._walker.look(turn[0] * _TURN_PER_PIXEL, turn[1] * _TURN_PER_PIXEL)
            self._area.tag_redraw()
        elif event.type in _MOVES:
            self._runs = event.shift
            (self._held.discard if event.value == "RELEASE" else self._held.add)(event.type)
        elif event.type in {"LEFT_SHIFT", "RIGHT_SHIFT"}:
            self._runs = event.value == "PRESS"
        elif event.type == "WINDOW_DEACTIVATE":
            self._held.clear()  # their release will not be told
        elif event.value == "PRESS":
            self._press(context, _SAME_KEY.get(event.type, event.type))
        return {"RUNNING_MODAL"}

    def cancel(self, context):
        self._end()

    def _press(self, context, key: str) -> None:
        preview, say = self._preview, self._overlay.say
        if key in _GROUP_KEYS:
            group, brighter = _GROUP_KEYS[key]
            value = actions.change_intensity(self._scene, group, brighter)
            name = group.replace("_", " ").capitalize()
            say(f"{name}: no light is in this group" if value is None else f"{name}: {value:.0%}")
        elif key in {"MINUS", "PLUS"}:
            self._paint(context, 1 if key == "PLUS" else -1)
        elif key == "NINE":
            say("Animation on" if self._animation.toggle() else "Animation off")
        elif key in {"PAGE_UP", "PAGE_DOWN"}:
            preview.exposure += _EXPOSURE_STEP if key == "PAGE_UP" else -_EXPOSURE_STEP
            say(f"Exposure {preview.exposure:+.2f}")
        elif key == "SPACE":
            preview.show_rate = not preview.show_rate
        elif key == "P":
            preview.show_probes = not preview.show_probes
            say("Probes shown" if preview.show_probes else "Probes hidden")
        elif key == "F1":
            self._overlay.help_is_open = not self._overlay.help_is_open
        elif key == "F9":
            self._screenshot(context)
        self._area.tag_redraw()

    def _paint(self, context, step: int) -> None:
        walls = actions.wall_materials(context, self._walker.eye)
        if not walls:
            self._overlay.say("No material to paint: walls need a plain base colour")
            return
        self._wall = (self._wall + step) % len(actions.WALL_COLORS)
        actions.paint(walls, self._wall)
        self._overlay.say(f"{', '.join(wall.name for wall in walls)}: colour {self._wall + 1}")

    def _screenshot(self, context) -> None:
        path = actions.screenshot_path()
        region = next(item for item in self._area.regions if item.type == "WINDOW")
        # A folder that cannot be written must not end the walk half-way.
        with contextlib.suppress(RuntimeError), context.temp_override(area=self._area, region=region):
            bpy.ops.screen.screenshot_area(filepath=str(path), check_existing=False)
        if not path.exists():
            self._overlay.say(f"Cannot write {path}; save the file elsewhere")
            return
        self._overlay.say(f"Saved {path}")
        self.report({"INFO"}, f"Saved {path}")

    def _step(self) -> None:
        now = time.perf_counter()
        seconds, self._moment = now - self._moment, now
        if self._held:
            ahead, right, up = np.sum([_MOVES[key] for key in self._held], axis=0).clip(-1, 1).tolist()
            self._walker.move(ahead, right, up, seconds * (_RUN if self._runs else 1.0))
        if self._held or self._overlay.is_fading or self._preview.show_rate:
            self._area.tag_redraw()

    def _draw(self) -> None:
        if bpy.context.area == self._area:
            self._overlay.draw()

    def _end(self) -> None:
        if self not in _running:
            return
        _running.remove(self)
        self._manager.event_timer_remove(self._timer)
        bpy.types.SpaceView3D.draw_handler_remove(self._drawing, "WINDOW")
        self._animation.stop()
        self._walker.leave()
        self._preview.enabled = self._was_enabled
        self._area.tag_redraw()


def _walking_speed(scene: bpy.types.Scene) -> float:
    """Metres a second that cross the scene in some seconds: rooms and landscapes both want to be seen."""
    corners = [
        np.array(item.matrix_world) @ np.array([*corner, 1.0])
        for item in scene.objects
        if item.type == "MESH"
        for corner in item.bound_box
    ]
    if not corners:
        return 1.0
    size = np.ptp(np.array(corners)[:, :3], axis=0).max()
    return max(float(size) / _WALK_SECONDS, 1e-3)


def stop_running() -> None:
    """Ends Explore mode from outside, when Gridlight is switched off."""
    for operator in list(_running):
        operator._end()


classes = (GRIDLIGHT_OT_explore,)
