# SPDX-License-Identifier: GPL-3.0-or-later
"""What an extension can leave behind in Blender, as Blender itself has it: nothing here asks the extension.

Blender lists neither timers nor draw handlers. But it holds the functions that it will call, so they are among the
objects that Python's garbage collector tracks, and it can be asked about each.
"""

from __future__ import annotations

import gc
from collections import Counter
from collections.abc import Iterator

import bpy

LISTEN_SECONDS = 0.15  # for events of timers; every timer of the extension is quicker than a tenth of a second
_KEPT_ON_PURPOSE = {"GPUShader"}  # for the session: docs/architecture.md


def timers(package: str) -> Counter:
    """Functions of ``package`` that ``bpy.app.timers`` will call, by name."""
    is_registered = bpy.app.timers.is_registered
    return Counter(
        _name(item) for item in gc.get_objects() if callable(item) and _owner(item, package) and is_registered(item)
    )


def draw_handlers(package: str) -> Counter:
    """Functions of ``package`` that Blender calls when it draws, by name and space.

    ``draw_handler_add`` keeps its arguments as the tuple that it was called with: (space, function, arguments,
    region, event).
    """
    return Counter(
        f"{item[0].__name__} {item[3]} {item[4]} {_name(item[1])}"
        for item in gc.get_objects()
        if type(item) is tuple
        and len(item) == 5
        and isinstance(item[0], type)
        and item[0].__name__.startswith("Space")
        and isinstance(item[4], str)
        and _owner(item[1], package)
    )


def application_handlers(package: str) -> Counter:
    """Functions of ``package`` in ``bpy.app.handlers``, by list."""
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    return Counter(
        {
            name: own
            for name, functions in lists.items()
            if isinstance(functions, list) and (own := sum(bool(_owner(item, package)) for item in functions))
        }
    )


def gpu_objects() -> Counter:
    """Textures, buffers, batches and framebuffers that Python holds, by type."""
    gc.collect()
    found = {}
    for holder in gc.get_objects():
        for item in gc.get_referents(holder):
            kind = type(item)
            if kind.__name__.startswith("GPU") and kind.__name__ not in _KEPT_ON_PURPOSE and not isinstance(item, type):
                found[id(item)] = kind.__name__
    return Counter(found.values())


def event_timers() -> Iterator[float]:
    """Listens for events of window-manager timers (``event_timer_add``) in every window; returns how many came.

    Such timers cannot be listed, but each sends TIMER events until it is removed. Blender's own, those of
    tooltips apart, send other types.
    """
    _Listener.heard, _Listener.is_over = 0, False
    bpy.utils.register_class(_Listener)
    try:
        for window in bpy.context.window_manager.windows:
            with bpy.context.temp_override(window=window):
                bpy.ops.wm.gridlight_test_listen("INVOKE_DEFAULT")
        yield LISTEN_SECONDS
        heard = _Listener.heard
        _Listener.is_over = True  # with the next event, which timers of this function's own send
        manager = bpy.context.window_manager
        ends = [manager.event_timer_add(0.01, window=window) for window in manager.windows]
        yield LISTEN_SECONDS
        for timer in ends:
            manager.event_timer_remove(timer)
    finally:
        bpy.utils.unregister_class(_Listener)
    return heard


class _Listener(bpy.types.Operator):
    """Counts TIMER events."""

    bl_idname = "wm.gridlight_test_listen"
    bl_label = "Listen for Timers"
    bl_options = {"INTERNAL"}
    heard = 0
    is_over = False

    def invoke(self, context, _event):
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, _context, event):
        if _Listener.is_over:
            return {"CANCELLED", "PASS_THROUGH"}
        _Listener.heard += event.type == "TIMER"
        return {"PASS_THROUGH"}


def _owner(function, package: str) -> bool:
    """Whether a callable, a method or a partial is of ``package``."""
    function = getattr(function, "func", function)
    return str(getattr(function, "__module__", "") or "").startswith(package)


def _name(function) -> str:
    function = getattr(function, "func", function)
    return f"{function.__module__}.{getattr(function, '__qualname__', type(function).__name__)}"
