# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests. A package, because pytest would otherwise name the folder ``gpu`` like Blender's module and hide it."""
