# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a job: what runs in which order, when it has converged, and what comes out."""
