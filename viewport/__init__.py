# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sees of the light: preview shading, probe spheres, readout, and the render engine.

Nothing here touches the GPU before something is to be drawn.
"""

_unregister: list = []


def register():
    from . import engine, handlers

    engine.register()
    _unregister.append(engine.unregister)
    handlers.register()
    _unregister.append(handlers.unregister)


def unregister():
    while _unregister:
        _unregister.pop()()


def sync(scene) -> None:
    """Starts or stops drawing, so that it matches ``scene.gridlight.preview.enabled``."""
    from . import handlers

    handlers.sync(scene)


def field_changed(volume_object) -> None:
    """Tells every view that another field was stored for ``volume_object``."""
    from . import changes, sessions

    sessions.mark_all(changes.FIELDS)


def stand_still(is_wanted: bool) -> None:
    """Views neither refine their pictures nor let light follow, until told otherwise."""
    from . import handlers

    handlers.stand_still(is_wanted)
