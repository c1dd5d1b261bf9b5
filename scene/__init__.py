# SPDX-License-Identifier: GPL-3.0-or-later
"""From a Blender scene to plain arrays: the only room that reads the depsgraph."""
