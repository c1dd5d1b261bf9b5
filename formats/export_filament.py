# SPDX-License-Identifier: GPL-3.0-or-later
"""Filament: one probe as the text that its ``cmgen --sh`` writes, for ``IndirectLight::Builder::irradiance``.

Nine lines, red, green and blue of a coefficient each. Filament's shader evaluates the same polynomial as Unity's,
c0 + c1·y + c2·z + c3·x + c4·xy + c5·yz + c6·(3z² − 1) + c7·xz + c8·(x² − y²), and multiplies by albedo, not albedo / π:
"pre-scaled" means that the basis functions' constants and the cosine lobe's A_l / π are in the numbers.
"""

from __future__ import annotations

import numpy as np

from ..core.spherical_harmonics import POLYNOMIAL_FACTORS, cosine_lobe
from .one_probe import LOSSES, choose_probe, nine_coefficients, place_of

AXES, PRECISION, BANDS, SUFFIX = "y-up", "float", 3, ".txt"
ENGINE = "Filament, IndirectLight; what reads the output of its cmgen --sh"
STORED = "irradiance / pi with the basis functions' constants folded in, nine RGB triples"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = [*LOSSES, "reflections: Filament takes them from a cubemap, see --to cubemap"]
SCALE = POLYNOMIAL_FACTORS * cosine_lobe(3) / np.pi


def write(job) -> dict:
    node = choose_probe(job)
    values = job.encode(nine_coefficients(job, node) * SCALE[:, None])
    orders = [(l, m) for l in range(3) for m in range(-l, l + 1)]
    lines = [
        f"({', '.join(f'{value:18.15f}' for value in row)}); // L{l}{m}, irradiance, pre-scaled base\n"
        for (l, m), row in zip(orders, values.astype(float).tolist())
    ]
    job.path(".txt").write_text("".join(lines), encoding="utf-8")
    return place_of(job, node)
