# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets: surfaces that let light through diffusely, so that what arrives on one side also leaves on the other.

Curtains, lamp shades, leaves, paper. Of irradiance E before and B behind, a sheet of reflectance R and transmittance T
sends R·E + T·B. With the albedo R + T and the share t = T / (R + T) that is (R + T) · ((1 − t)·E + t·B): the light of
a patch on a sheet is measured on both of its sides, and everything that reads the light of patches stays as it is.
Hits of another sheet are other patches, as the share belongs to the patch.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .errors import InputError
from .snapshot import Material

MOST_SHEETS = 2048  # their numbers are part of the keys of cells, which are whole numbers in float32


def sheet_numbers(materials: Sequence[Material]) -> tuple[np.ndarray, np.ndarray]:
    """(M,) int number of each material's sheet, 0 for what lets nothing through, and (S, 3) the share t of each sheet
    per channel, 0 for number 0. At least one material is assumed where there is none.

    Raises:
        InputError: more sheets than can be numbered.
    """
    numbers: dict[tuple[float, ...], int] = {(0.0, 0.0, 0.0): 0}
    of_material = [numbers.setdefault(material.transmitted, len(numbers)) for material in materials] or [0]
    if len(numbers) > MOST_SHEETS:
        raise InputError(
            f"the scene has {len(numbers) - 1} different translucent materials, {MOST_SHEETS - 1} is the most; let "
            "some of them share a material"
        )
    return np.array(of_material), np.array(list(numbers))
