# SPDX-License-Identifier: GPL-3.0-or-later
"""What leaves Gridlight: the probe file, reports, engine exports. Never imports Blender."""
