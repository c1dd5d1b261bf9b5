# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes beyond one machine: a plan, shards, a merge, and Dask to run them. Not part of the extension."""
