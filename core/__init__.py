# SPDX-License-Identifier: GPL-3.0-or-later
"""Mathematics and data of probe baking: numpy and the standard library only, never Blender."""
