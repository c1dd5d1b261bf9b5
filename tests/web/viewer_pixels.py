# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of the viewer's page as irradiance at places, and where in the field three.js looked for them."""

from pathlib import Path

import numpy as np
from export_fields import Y_UP

HERE = Path(__file__).parent


def measured(browse, folder, reach):
    """(places, normals, irradiance) of the viewer's pixels, in three.js's space.

    The page is the exported index.html with measure.js added; views are taken from ``reach`` box sizes off the middle.
    """
    page = (folder / "index.html").read_text()
    script = f'<script>const MEASURE = {{ reach: {reach} }};</script><script type="module" src="measure.js"></script>'
    (folder / "measure.html").write_text(page.replace("</body>", script + "</body>"))
    result = browse(folder, "measure.html", {"measure.js": HERE / "measure.js"})
    assert result["revision"] == "187" and "WebGL" in result["renderer"]
    rows = np.array(result["rows"])
    return rows[:, :3], rows[:, 3:6], np.pi * rows[:, 6:9]


def where_it_looks(places, normals, about):
    """Blender-space points at which three.js interpolates, half a cell along the normals, and which of them lie among
    the probes. ``about`` is probes.json."""
    spacing = np.array(about["size"]) / about["resolution"]
    places = places + normals * spacing / 2
    low = np.array(about["center"]) - np.array(about["probe_extent"]) / 2
    return places @ Y_UP, ((places >= low) & (places <= low + about["probe_extent"])).all(axis=1)
