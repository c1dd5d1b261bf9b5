# SPDX-License-Identifier: GPL-3.0-or-later
"""What texels on glossy surfaces mirror, on the GPU: see core/gloss.py. Scenes without such surfaces have no part in
it.

Their rays are traced where texels are bound to patches, and end on patches as rays of rays do. Which part of whose
irradiance a texel shows is kept with the surfaces; those who read the light of texels put it together.
"""

from __future__ import annotations

import gpu

from ..core.gloss import TEXEL_RAYS
from ..core.steps import Pace, Steps
from .dispatch import compaction_groups, compaction_run, dispatch_linear
from .elements import fill_elements
from .patch_finder import PatchFinder
from .places import Places
from .programs import program
from .scene_textures import SceneTextures
from .textures import allocate, read_number, scratch

_BYTES_PER_TEXEL = 16 * (TEXEL_RAYS + 1)  # of a kept surface, beside what every surface takes


class GlossPass:
    """Reflections of the texels of one bake."""

    def __init__(self, scene: SceneTextures, face: int):
        self._scene, self._face = scene, face

    @property
    def bytes_per_texel(self) -> int:
        """Of kept surfaces."""
        return _BYTES_PER_TEXEL if self._scene.has_gloss else 0

    @property
    def defines(self) -> dict:
        """For shaders that read the light of texels."""
        return {"REFLECTIONS": TEXEL_RAYS} if self._scene.has_gloss else {}

    def bind(self, shader, textures: dict, irradiance: gpu.types.GPUTexture) -> None:
        """Hands a shader compiled with ``defines`` what the surfaces ``textures`` mirror, by the ``irradiance`` of
        patches."""
        if self._scene.has_gloss:
            shader.uniform_sampler("mirrored", textures["mirrored"])
            shader.uniform_sampler("mirrored_irradiance", irradiance)

    def reflect(
        self,
        textures: dict,
        layers: tuple[int, int, int],
        probe_slots: gpu.types.GPUTexture,
        first_slot: int,
        world_texels: gpu.types.GPUTexture,
        patches: PatchFinder,
        seed: int,
        pace: Pace,
    ) -> Steps[None]:
        """Finds what glossy texels of some ``layers`` (first, count, number of all) of the surfaces ``textures``
        mirror, and what they send back diffusely, in steps. Where rays end, ``patches`` are found. The slot of the
        first of these layers is ``first_slot``."""
        if not self._scene.has_gloss:
            return
        first, count, layer_count = layers
        texels_each = 6 * self._face**2
        glossy, found = self._glossy(textures, first, count * texels_each)
        entries = scratch(count * texels_each, "texels", "R32F")
        fill_elements(entries, 0, count * texels_each, -1.0)

        def run(shader: gpu.types.GPUShader, start: int, number: int) -> None:
            self._scene.bind_surfaces(shader)
            self._scene.bind_gloss(shader)
            self._scene.bind_sheets(shader)
            shader.uniform_sampler("geometry", textures["geometry"])
            shader.uniform_sampler("glossy", glossy)
            shader.uniform_sampler("probe_slots", probe_slots)
            shader.image("carried", found.carried)
            where = ("first_slot", first_slot), ("first_layer", first), ("first", start), ("count", number)
            for name, value in (*where, ("seed", seed)):
                shader.uniform_int(name, (value,))
            dispatch_linear(shader, number)

        def look(start: int, number: int) -> None:
            shader = self._program("texel_lamps_comp", HAS_EMITTERS=False)
            self._scene.bind_lamps(shader)
            run(shader, start, number)

        def trace(start: int, number: int) -> None:
            shader = self._program("texel_reflections_comp")
            self._scene.bind_mirrored_lights(shader)
            shader.uniform_sampler("world_texels", world_texels)
            shader.image("albedo", textures["albedo"])
            shader.image("entries", entries)
            for name in ("hits", "reflected"):
                shader.image(name, getattr(found, name))
            if found.sheets is not None:
                shader.image("hit_sheets", found.sheets)
            run(shader, start, number)

        yield from pace.portions("look", found.count, look, first=1024)
        yield from pace.portions("reflect", found.count, trace, first=1024)
        ends = entries
        if found.count:
            ends = patches.bind_ends(Places(found.hits, 1, found.sheets), found.count * TEXEL_RAYS, 0)
        if "mirrored" not in textures:
            textures["mirrored"] = allocate(layer_count * texels_each * (TEXEL_RAYS + 1), "texels")
        texels = first * texels_each, count * texels_each
        self._put_together(textures["mirrored"], entries, ends, found, patches, texels)

    def _put_together(
        self,
        mirrored: gpu.types.GPUTexture,
        entries: gpu.types.GPUTexture,
        ends: gpu.types.GPUTexture,
        found: _Found,
        patches: PatchFinder,
        texels: tuple[int, int],
    ) -> None:
        """What was ``found``, for ``texels`` (first, count) of the surfaces, those that are no ``entries`` among them;
        patches at the ``ends`` of rays are marked as seen."""
        shader = program("texel_mirrored_comp", REFLECTIONS=TEXEL_RAYS)
        for name, texture in (
            ("entries", entries),
            ("ends", ends),
            ("reflected", found.reflected),
            ("carried", found.carried),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("mirrored", mirrored)
        shader.image("seen", patches.seen)
        for name, value in zip(("first_texel", "texel_count"), texels):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, texels[1])

    def _glossy(self, textures: dict, first_layer: int, texels: int) -> tuple[gpu.types.GPUTexture, _Found]:
        """The glossy ones of so many ``texels`` from layer ``first_layer`` on, in order, and room for what they see:
        on processors as on GPUs, threads wait for their neighbours."""
        groups = compaction_groups(texels)
        counts, listed = scratch(groups, "texels", "R32F"), scratch(texels, "texels", "R32F")
        total = gpu.types.GPUTexture((1, 1), format="R32F")
        for name in ("glossy_count_comp", "glossy_list_comp"):
            shader = program(name, FACE=self._face, RUN=compaction_run())
            self._scene.bind(shader, "triangle_attributes", "gloss_rows")
            shader.uniform_sampler("geometry", textures["geometry"])
            if name == "glossy_count_comp":
                shader.image("block_counts", counts)
            else:
                shader.uniform_sampler("block_counts", counts)
                shader.image("total_out", total)
                shader.image("listed", listed)
            shader.uniform_int("first_layer", (first_layer,))
            shader.uniform_int("texel_count", (texels,))
            gpu.compute.dispatch(shader, groups, 1, 1)
        return listed, _Found(read_number(total), self._scene.has_sheets)

    def _program(self, name: str, **defines):
        return program(name, FACE=self._face, **(self._scene.path_defines | defines))


class _Found:
    """What rays of ``count`` texels found, see texel_reflections_comp.glsl."""

    def __init__(self, count: int, has_sheets: bool):
        rays = count * TEXEL_RAYS
        self.count = count
        self.hits, self.reflected = scratch(rays, "rays"), scratch(rays, "rays")
        self.carried = scratch(count, "texels")
        self.sheets = scratch(rays, "rays", "R32F") if has_sheets else None
