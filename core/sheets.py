# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets: surfaces that let light through diffusely, so that what arrives on one side also leaves on the other.

Curtains, lamp shades, leaves, paper. Of irradiance E before and B behind, a sheet of reflectance R and transmittance T
sends R·E + T·B. With the albedo R + T and the share t = T / (R + T) that is (R + T) · ((1 − t)·E + t·B): the light of
a patch on a sheet is measured on both of its sides, and everything that reads the light of patches stays as it is.
Hits of another sheet are other patches, as the share belongs to the patch. So are hits of another role in light linking
(core/light_links.py): roles are told apart by numbers of sheets that may let nothing through.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .errors import InputError
from .rays import pull_back
from .snapshot import Material

MOST_SHEETS = 2048  # their numbers are part of the keys of cells, which are whole numbers in float32


def sheet_numbers(materials: Sequence[Material], roles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(M,) int number of each material's sheet, and (S, 4) the share t of each sheet per channel and its role.
    Number 0 lets nothing through and has role 0, that of no linking. At least one material is assumed where there is
    none; ``roles`` (M,) are those of the materials.

    Raises:
        InputError: more sheets than can be numbered.
    """
    numbers: dict[tuple[float, ...], int] = {(0.0, 0.0, 0.0, 0.0): 0}
    of_material = [
        numbers.setdefault((*material.transmitted, float(role)), len(numbers))
        for material, role in zip(materials, roles)
    ] or [0]
    if len(numbers) > MOST_SHEETS:
        raise InputError(
            f"the scene has {len(numbers) - 1} different translucent materials or ways to be linked to lights, "
            f"{MOST_SHEETS - 1} is the most; let some of them share a material"
        )
    return np.array(of_material), np.array(list(numbers))


def off_surface(points: np.ndarray, directions: np.ndarray, distances: np.ndarray, sheets: np.ndarray) -> np.ndarray:
    """Hit ``points`` (H, 3) as patches keep them: pulled back along their rays, but on the surface itself where that is
    one of ``sheets`` (H,) bool, which rays leave on both sides."""
    return np.where(sheets[:, None], points, pull_back(points, directions, distances))


def side_weight(through: np.ndarray, crosses: np.ndarray) -> np.ndarray:
    """(C, 3) weight of rays of which half go on from the back of their sheet, those that cross it (C,), where it shows
    the share ``through`` (C, 3) of its back; 1 for what is no sheet."""
    share = np.where(crosses[:, None], through, 1 - through)
    return np.where(through.any(axis=1, keepdims=True), 2 * share, 1.0)
