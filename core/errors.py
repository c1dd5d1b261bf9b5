# SPDX-License-Identifier: GPL-3.0-or-later
"""The ways a Gridlight command can end, each with its exit status.

Raise these with one plain line that names the thing and the remedy; the command line prints that line
and exits with ``exit_status``, an operator reports it. Nothing else is meant to reach the user.
"""


class GridlightError(Exception):
    """Base class; never raised itself."""

    exit_status = 1


class InputError(GridlightError):
    """The input or the options are wrong."""

    exit_status = 2


class NoGpuError(GridlightError):
    """No usable GPU context could be made."""

    exit_status = 3


class Cancelled(GridlightError):
    """The user stopped the work; nothing half-written is left."""

    exit_status = 130
