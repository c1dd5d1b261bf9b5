# SPDX-License-Identifier: GPL-3.0-or-later
"""One bake taken apart: every stage on the GPU, read back, beside the reference fed with what the GPU had before that
stage."""

from dataclasses import dataclass, replace

import numpy as np
from gridlight.core import steps
from gridlight.core.conventions import INVALID
from gridlight.core.cubemap import octahedral_decode
from gridlight.core.field import Field
from gridlight.core.orientation import inside_solid
from gridlight.core.patches import ALL
from gridlight.core.reference_bake import ReferenceBake
from gridlight.core.reference_scene import Surfaces
from gridlight.gpu_shaders.backend import GpuBackend
from gridlight.gpu_shaders.patch_light import Rays
from gridlight.gpu_shaders.places import Places
from gridlight.gpu_shaders.textures import allocate, numbers, read, upload
from shader_runner import read_layers, run

BACKGROUND = 1e29  # distances from here on


@dataclass
class Connections:
    """Rays between patches as the GPU keeps them; N patches, R rays each."""

    brought: np.ndarray  # (N, 3)
    reflected: np.ndarray  # (N, R, 3)
    ends: np.ndarray  # (N, R)


class PatchesOfGpu:
    """Stands in for the reference's patches where it reads light at those of the GPU."""

    def __init__(self, finder):
        self._finder = finder

    def bind_ends(self, hits, round_, sees, sheets):
        sheets = numbers(sheets, "test") if self._finder.places.sheets is not None else None
        bound = self._finder.bind_ends(Places(upload(hits, "test"), 1, sheets), len(hits), round_)
        return read(bound, len(hits), channels=1)[:, 0].astype(int)


class Stages:
    """Captures ``snapshot`` for all of the grid's active probes at once and finds their patches."""

    def __init__(self, snapshot, grid, settings, method="trace"):
        self.reference = ReferenceBake(snapshot, grid, settings)
        self.settings, self.grid = settings, grid
        self.backend = GpuBackend(snapshot, grid, settings)
        nodes = self.reference.nodes
        self.backend.set_probes(nodes, grid.positions()[nodes])
        self.backend.allocate_field()
        self.gpu = self.backend.surfaces(0, len(nodes))
        self.capture(method)
        steps.run(self.backend.bind(self.gpu))

    @property
    def light(self):
        return self.backend.light

    def capture(self, method):
        self.backend.capture(self.gpu, method)

    def use_lights(self, lights):
        """Other lamps for both."""
        self.backend.scene.set_lights(lights, self.grid.center)
        scene = self.reference.scene
        scene.snapshot = replace(scene.snapshot, lights=lights)

    # Texels
    # ------------------------------------------------------------------------------------------------------------------

    def _texels(self, name):
        """(P, X, 4)"""
        face = self.settings.face
        layers = read_layers(self.gpu.textures[name], face, 6 * face, self.gpu.count)
        return layers.reshape(self.gpu.count, 6 * face * face, 4)

    def surfaces(self):
        """The GPU's texel surfaces as the reference keeps them."""
        geometry, albedo, emission = (self._texels(name) for name in ("geometry", "albedo", "emission"))
        distance = np.abs(geometry[..., 2]).astype(float)
        seen = distance < BACKGROUND
        triangle = self.backend.scene.hierarchy.order[np.where(seen, geometry[..., 3], 0).astype(int)]
        return Surfaces(
            np.where(seen, distance, np.inf),
            np.where(seen, triangle, -1),
            geometry[..., 2] < 0,
            octahedral_decode(geometry[..., :2]),
            albedo[..., :3].astype(float),
            emission[..., :3].astype(float),
        )

    def patch(self):
        """(P, X) patches that texels lie on."""
        return self._texels("albedo")[..., 3].astype(int)

    def hits_texture(self):
        return self.backend._texel_hits(self.gpu, 0, self.gpu.count)

    def hits(self):
        """(P·X, 4) position and packed normal of texels."""
        return read(self.hits_texture().points, self.gpu.count * 6 * self.settings.face**2)

    def irradiance_at_texels(self, samples):
        """(P, X, 3) direct light of each texel by itself, 0 where nothing reflects."""
        hits = self.hits_texture()
        count = self.gpu.count * 6 * self.settings.face**2
        direct = allocate(count, "test")
        lit = np.flatnonzero(self.hits()[:, 3] >= 0)
        steps.run(self.light._direct.light(hits, numbers(lit, "test"), [(0, len(lit), samples)], direct))
        return read(direct, count)[:, :3].reshape(self.gpu.count, -1, 3)

    # Patches
    # ------------------------------------------------------------------------------------------------------------------

    @property
    def points(self):
        """(N, POINTS, 4)"""
        return self.light.patches.read_points()

    @property
    def sheets(self):
        """(N,) sheets that patches are part of."""
        return read(self.light.patches.places.sheets, self.light.count, channels=1)[:, 0].astype(int)

    def sees_leader(self, hits, patches):
        """(H,) the GPU's word on which ``hits`` (H, 4) see the leader of their patch (H,)."""
        scene = self.backend.scene
        defines = {name: "" if value is True else value for name, value in scene.ray_defines.items() if value}
        surfaces = ["surface_lib"] if scene.has_alpha else []
        names = ["bvh_nodes", "triangle_corners"]
        if scene.has_alpha:
            names += ["triangle_attributes", "materials"] + ["image_table", "image_texels"] * scene.has_images
        found = run(
            "sight",
            len(hits),
            libraries=["data_lib", "octahedral_lib", *surfaces, "offset_lib", "ray_lib", "patch_sight_lib"],
            inputs={"hits": hits, "leaders": self.points[patches, 0]},
            textures_2d={name: scene._textures[name] for name in names},
            defines=defines,
        )
        return found[:, 0] > 0

    def spread(self, part):
        """(2, N) how unevenly ``part`` of the light lights the patches."""
        result = allocate(self.light.count, "test", "RG32F")
        self.light._direct.find_spread(part, self.light.patches.places, 0, self.light.count, result)
        return read(result, self.light.count, channels=2).T

    def direct_of(self, patches, samples, part=ALL):
        """(C, 3) direct light of ``patches`` (C,) by so many samples of ``part``."""
        direct = allocate(self.light.count, "test")
        chosen = numbers(patches, "test")
        lists = [(0, len(patches), samples)]
        steps.run(self.light._direct.light(self.light.patches.places, chosen, lists, direct, part=part))
        return read(direct, self.light.count)[patches, :3].astype(float)

    def direct(self):
        """(N, 3) direct light as the bake takes it."""
        steps.run(self.light.light_new_patches())
        return read(self.light.direct, self.light.count)[:, :3].astype(float)

    def rays(self, first, count, rays_each, segments=1):
        """hits (C, R, 4), brought (C, 3), reflected (C, R, 3) of ``count`` patches from ``first``."""
        stop = first + count
        reflected, brought = allocate(stop * rays_each, "test"), allocate(stop, "test")
        places = self.light.patches.places
        hits = self.light._trace(Rays(places, first, count, rays_each, reflected, brought, segments))
        return (
            read(hits.points, count * rays_each).reshape(count, rays_each, 4),
            read(brought, stop)[first:, :3],
            read(reflected, stop * rays_each)[first * rays_each :, :3].reshape(count, rays_each, 3),
        )

    def connect(self):
        """Connections of all patches, among them those that only rays see."""
        steps.run(self.light.light_new_patches())
        steps.run(self.light.connect())
        count, each = self.light.count, self.light._rays_each
        return Connections(
            read(self.light._brought.texture, count)[:, :3].astype(float),
            read(self.light._reflected.texture, count * each)[:, :3].reshape(count, each, 3).astype(float),
            read(self.light._ends.texture, count * each, channels=1).reshape(count, each).astype(int),
        )

    def iterate(self, bounce):
        """(N, 3) irradiance after one iteration more, the sums that judge it, and its luminance."""
        self.light.iterate(bounce)
        ((sums, luminance),) = self.light.differences()
        return read(self.light.irradiance, self.light.count)[:, :3].astype(float), sums, luminance

    # Probes
    # ------------------------------------------------------------------------------------------------------------------

    def statistics(self):
        """The GPU's states and depth as a field without light. Needs direct light."""
        backend, nodes = self.backend, self.reference.nodes
        reflected = self.reference.reflected(self.surfaces(), self.patch(), self.direct())
        backend.set_shells(self.reference.shells(self.surfaces(), reflected))
        backend.statistics(self.gpu)
        shares = backend.read_shares()
        field = Field.empty(self.grid, self.settings.bands)
        field.state[:] = self.reference.state
        field.state[nodes[inside_solid(shares)]] = INVALID
        field.validity[nodes] = 1 - shares[:, 0]
        field.depth[nodes] = backend.read_depth()
        return field

    def project(self):
        """(P, K, 3) the field by the newest irradiance, without sampled emitters."""
        self.backend.project(self.gpu, np.arange(self.gpu.count))
        return self.backend.read_field()

    def project_emitters(self):
        """(P, K, 3) what sampled emitters add to the field."""
        before = self.project()
        self.backend.find_emission(self.gpu, np.arange(self.gpu.count))
        return self.project() - before
