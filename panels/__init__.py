# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sees in the sidebar."""


def register():
    pass


def unregister():
    pass
