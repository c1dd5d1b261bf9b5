# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene snapshot as files of a job, so that shards need neither the .blend nor what it links to.

Every array is a file of its own, named by its content: frames of an animation share those that stand still.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from ..core.camera import Camera
from ..core.gloss import Gloss
from ..core.light_links import Links
from ..core.light_profiles import LightProfile
from ..core.snapshot import Image, Light, Material, SceneSnapshot, World
from . import container

_ARRAYS = ("vertices", "triangles", "corner_normals", "corner_uvs", "material_index", "object_index")
STILL = (*_ARRAYS, "object_names", "materials", "images")  # parts of a document that texel surfaces depend on


def write_scene(folder: Path, snapshot: SceneSnapshot) -> dict:
    """Writes the arrays of ``snapshot`` to ``folder``; returns the document that ``SceneReader`` makes it from again,
    plain values for JSON. Volumes are left out."""
    document: dict = {name: _write_array(folder, getattr(snapshot, name)) for name in _ARRAYS}
    document["object_names"] = list(snapshot.object_names)
    document["materials"] = [_plain(material) for material in snapshot.materials]
    document["images"] = [
        {"name": image.name, "pixels": _write_array(folder, image.pixels), "extension": image.extension}
        for image in snapshot.images
    ]
    document["lights"] = [_plain(light) for light in snapshot.lights]
    world_map = snapshot.world.map
    document["world"] = {
        "color": _plain(snapshot.world.color),
        "map": None if world_map is None else _write_array(folder, world_map),
    }
    document["frame"], document["name"] = int(snapshot.frame), snapshot.name
    document["camera"] = None if snapshot.camera is None else _plain(snapshot.camera)
    document["exposure"] = float(snapshot.exposure)
    return document


class SceneReader:
    """Makes snapshots from documents. Arrays that the snapshot before had are taken from it."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._arrays: dict[str, np.ndarray] = {}

    def read(self, document: dict) -> SceneSnapshot:
        """Raises container.Damaged."""
        before, self._arrays = self._arrays, {}
        arrays: dict = {name: self._array(document[name], before) for name in _ARRAYS}
        images = [
            Image(image["name"], self._array(image["pixels"], before), image["extension"])
            for image in document["images"]
        ]
        world = document["world"]
        return SceneSnapshot(
            **arrays,
            object_names=document["object_names"],
            materials=[_material(material) for material in document["materials"]],
            images=images,
            lights=[_light(light) for light in document["lights"]],
            world=World(tuple(world["color"]), None if world["map"] is None else self._array(world["map"], before)),
            camera=None if document["camera"] is None else Camera(**_arrays(document["camera"])),
            exposure=document["exposure"],
            frame=document["frame"],
            name=document["name"],
        )

    def _array(self, name: str, before: dict[str, np.ndarray]) -> np.ndarray:
        if name not in self._arrays:
            if name in before:
                self._arrays[name] = before[name]
            else:
                path = self._folder / name
                container.check(path)
                self._arrays[name] = container.arrays(path)[1]["values"]
        return self._arrays[name]


def _write_array(folder: Path, array: np.ndarray) -> str:
    return container.write(folder, "array", {}, {"values": np.asarray(array)}).name


def _plain(value):
    """``value`` in what JSON knows; numbers keep every bit."""
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _material(values: dict) -> Material:
    lobes = {name: values[name] and Gloss(**_tuples(values[name])) for name in ("gloss", "faint_gloss")}
    return Material(**_tuples({**values, **lobes, "links": Links(**values["links"])}))


def _light(values: dict) -> Light:
    profile = values["profile"] and LightProfile(**_arrays(values["profile"]))
    return Light(**_tuples({**values, "matrix": np.array(values["matrix"], float), "profile": profile}))


def _tuples(values: dict) -> dict:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def _arrays(values: dict) -> dict:
    return {name: np.array(value) if isinstance(value, list) else value for name, value in values.items()}
