# SPDX-License-Identifier: GPL-3.0-or-later
"""The atlas of a material's surface: lookups within triangles give back what their texels were given."""

import importlib.util
import sys
import types

import numpy as np
import pytest


@pytest.fixture(scope="module")
def surface_atlas(root):
    """The module alone: its package needs Blender."""
    spec = importlib.util.spec_from_file_location("surface_atlas", root / "scene" / "surface_atlas.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["surface_atlas"] = module
    spec.loader.exec_module(module)
    assert isinstance(module, types.ModuleType)
    return module


def bilinear(pixels, uv):
    height, width = pixels.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    i, j = np.floor(x + 1e-4).astype(int), np.floor(y + 1e-4).astype(int)
    s, t = x - i, y - j
    right, above = np.minimum(i + 1, width - 1), np.minimum(j + 1, height - 1)
    below = pixels[j, i] * (1 - s) + pixels[j, right] * s
    return below * (1 - t) + (pixels[above, i] * (1 - s) + pixels[above, right] * s) * t


@pytest.mark.parametrize("count", [1, 2, 700, 100_000])
def test_what_is_linear_over_triangles_is_looked_up_exactly(surface_atlas, count):
    random = np.random.default_rng(count)
    atlas = surface_atlas.lay_out(random.lognormal(0, 1.5, count))
    corners = random.uniform(0, 1, (count, 3, 1))
    pixels = atlas.interpolate(corners).reshape(atlas.shape)
    chosen = random.integers(0, count, 2000)
    weights = random.dirichlet([0.3, 0.3, 0.3], 2000)
    uv = np.einsum("ni,nic->nc", weights, atlas.corner_uvs[chosen])
    expected = np.einsum("ni,ni->n", weights, corners[chosen, :, 0])
    assert np.abs(bilinear(pixels, uv) - expected).max() < 2e-3  # float32 texture coordinates


def test_few_texels_are_wasted_and_many_triangles_still_fit(surface_atlas):
    atlas = surface_atlas.lay_out(np.random.default_rng(1).lognormal(0, 1, 500))
    used = np.unique(atlas.triangle, return_counts=True)[1]
    assert len(used) == 500 and atlas.triangle.size < 1.6 * surface_atlas.MOST_TEXELS
    assert surface_atlas.lay_out(np.ones(300_000)).triangle.size < 310_000
    assert not surface_atlas.fits(0) and not surface_atlas.fits(10_000_000)
