# SPDX-License-Identifier: GPL-3.0-or-later
"""three.js: one probe as the JSON of a ``LightProbe``, which ``ObjectLoader`` reads.

``sh`` holds 9 coefficients of 3 colours one after the other, radiance: three.js applies the cosine lobe itself
(``shGetIrradianceAt``). A LightProbe lights the whole scene; grids are what ``three`` is for.
"""

from __future__ import annotations

import json
import uuid

from .one_probe import LOSSES, choose_probe, nine_coefficients, place_of
from .probe_metadata import program_version

AXES, PRECISION, BANDS, SUFFIX = "y-up", "float", 3, ".json"
ENGINE = "three.js, LightProbe by ObjectLoader"
STORED = "radiance coefficients, orthonormal; the shader applies the cosine lobe"
RUN_IN_ENGINE = True
DOES_NOT_CARRY = LOSSES


def write(job) -> dict:
    node = choose_probe(job)
    place = place_of(job, node)
    x, y, z = place["position"]
    values = job.encode(nine_coefficients(job, node)).astype(float).ravel().tolist()
    document = {
        "metadata": {"version": 4.6, "type": "Object", "generator": f"Gridlight {program_version()}"},
        "object": {
            "uuid": str(uuid.uuid5(uuid.NAMESPACE_OID, json.dumps(values))),  # the same light gives the same bytes
            "type": "LightProbe",
            "name": job.source.grid.name,
            "layers": 1,
            "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1],
            "color": 0xFFFFFF,
            "intensity": 1,
            "sh": values,
        },
    }
    job.path(".json").write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
    return place
