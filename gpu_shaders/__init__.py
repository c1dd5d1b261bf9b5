# SPDX-License-Identifier: GPL-3.0-or-later
"""GLSL and what runs it: one file per stage in ``glsl/``, bindings in ``create_infos``, passes on top."""
