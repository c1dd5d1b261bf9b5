# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that the GPU cannot number are refused before anything is built."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import box, snapshot_of


def test_too_many_triangles_are_refused_in_one_line():
    count = (1 << 24) + 1
    huge = replace(snapshot_of(box()), triangles=np.broadcast_to(np.int32(0), (count, 3)), name="Forest")
    with pytest.raises(InputError, match=r"'Forest' has 16777217 triangles, 16777216 is the most; hide"):
        SceneTextures(huge, np.zeros(3), np.zeros(count))
