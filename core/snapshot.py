# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene as plain arrays: what ``scene/`` produces and every other room consumes.

Everything is in Blender's world space (right-handed, Z up, metres) and in linear RGB. Positions are
float64, because a scene may stand 1000 km from the origin; whoever sends them to the GPU subtracts the
volume's centre first.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .camera import Camera
from .gloss import Gloss
from .light_links import UNLINKED, Links
from .light_profiles import LightProfile

NO_IMAGE = -1
# Rays that may not see a surface: of a kind, or all from one side.
SHADOW_RAYS, DIFFUSE_RAYS, FROM_BEHIND, FROM_FRONT, CAMERA_RAYS = 1, 2, 4, 8, 16
DITHERED = 2.0  # an ``alpha_threshold`` above what alpha can be: every place has one of its own, by chance


@dataclass(frozen=True)
class Image:
    """An image as it lights the scene.

    ``pixels`` is (height, width, 4) float32, linear RGB (not premultiplied) and alpha, row 0 at the bottom (v = 0),
    as Blender stores images.
    """

    name: str
    pixels: np.ndarray
    # REPEAT | EXTEND | CLIP | MIRROR, as in Blender's image texture node; ATLAS: never mipped
    extension: str = "REPEAT"


@dataclass(frozen=True)
class Material:
    """What a surface does with light: a diffuse reflector that may emit and may have holes.

    The reflected part is ``base_color × base texture × diffuse_share``: ``diffuse_share`` is what is left after
    metallic, transmission and mix weights took theirs. Emission is ``emission × emission texture`` and is
    radiance. A texel with alpha below ``alpha_threshold`` is a hole (0: no clip; DITHERED: with the chance 1 − alpha,
    see ``core.dithering``). Of the part that is sent back the share ``transmitted``, per channel, leaves on the other
    side than that where the light arrived (see ``core.sheets``); of the part of a material with ``gloss`` a share is
    mirrored (see ``core.gloss``); ``faint_gloss`` instead is sent in all directions (see ``core.faint_gloss``).
    """

    name: str
    base_color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    diffuse_share: float = 1.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    base_image: int = NO_IMAGE
    emission_image: int = NO_IMAGE
    alpha_image: int = NO_IMAGE
    alpha_from_color: bool = False  # the alpha input was fed by the colour output: use its mean
    alpha: float = 1.0
    alpha_threshold: float = 0.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)  # what holes leave of light that passes, times the tint image
    tint_image: int = NO_IMAGE
    transmitted: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gloss: Gloss | None = None
    faint_gloss: Gloss | None = None
    unseen_by: int = 0  # sum of SHADOW_RAYS, DIFFUSE_RAYS and so on: for these the surface is not there
    links: Links = UNLINKED  # which emitters' light falls on it, and passes it
    backface_culling: bool = False  # stated only; light transport treats every surface as two-sided, like Cycles

    @property
    def is_tinted(self) -> bool:
        """Whether it has holes, and they are coloured."""
        return self.alpha_threshold > 0 and (self.tint != (1.0, 1.0, 1.0) or self.tint_image != NO_IMAGE)


@dataclass(frozen=True)
class Light:
    """A light object.

    Frame: ``matrix`` columns 0..2 are the orthonormal axes right, up, back (a light shines along −column 2), column 3
    the position. ``color`` carries all scale factors (colour × temperature × 2^exposure) so that the units below are
    complete:

    ======  =====================================================  ==============================
    kind    ``color`` means                                         size
    ======  =====================================================  ==============================
    POINT   radiant intensity W/sr (power / 4π)                     radius m
    SPOT    radiant intensity W/sr on the axis (power / 4π)         radius m, spot_size rad, spot_blend 0..1
    SUN     irradiance W/m² on a facing surface                     angle rad (full apparent diameter)
    AREA    radiance W/(m² sr) of the face (power / π area)         size_x, size_y m, shape, spread rad
    ======  =====================================================  ==============================
    """

    name: str
    kind: str  # POINT | SPOT | SUN | AREA
    color: tuple[float, float, float]
    matrix: np.ndarray  # (4, 4) float64
    radius: float = 0.0
    soft_falloff: bool = True
    angle: float = 0.0
    spot_size: float = 0.0
    spot_blend: float = 0.0
    spot_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)  # of the object: stretches the cone, as in Cycles
    shape: str = "RECTANGLE"  # RECTANGLE | ELLIPSE
    size_x: float = 0.0
    size_y: float = 0.0
    spread: float = np.pi
    casts_shadow: bool = True
    dynamic: bool = False  # animated or marked dynamic: its direct light is not kept
    group: str = ""  # role in Explore mode and in reports
    profile: LightProfile | None = None  # what nodes make of its light; not of suns
    link_group: int = 0  # see core.light_links


@dataclass(frozen=True)
class World:
    """Background radiance: one colour, or an equirectangular map.

    ``map`` is (height, width, 3) float32 in the layout of ``core.panorama``, which is Blender's: row 0 is straight down
    (−Z), u = ½ − atan2(y, x)/2π, v = atan2(z, √(x²+y²))/π + ½, so u = 0 looks along −X, ¼ along +Y, ½ along +X.
    """

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    map: np.ndarray | None = None


@dataclass(frozen=True)
class Volume:
    """A probe volume found in the scene: its transform is the box (unit cube −1..1 mapped by ``matrix``)."""

    name: str
    matrix: np.ndarray  # (4, 4) float64
    resolution: tuple[int, int, int]


@dataclass(frozen=True)
class SceneSnapshot:
    """Triangles, materials, lights and world of one evaluated frame.

    Shapes: V vertices, T triangles.
    """

    vertices: np.ndarray  # (V, 3) float64, world
    triangles: np.ndarray  # (T, 3) int32 into vertices, counter-clockwise seen from the front
    corner_normals: np.ndarray  # (T, 3, 3) float32, world, unit length
    corner_uvs: np.ndarray  # (T, 3, 2) float32, the material's texture mapping already applied
    material_index: np.ndarray  # (T,) int32 into materials
    object_index: np.ndarray  # (T,) int32 into object_names: one entry per evaluated instance
    object_names: list[str]
    materials: list[Material]
    images: list[Image]
    lights: list[Light]
    world: World
    volumes: list[Volume] = field(default_factory=list)
    camera: Camera | None = None
    exposure: float = 0.0  # the scene's view exposure, stops, for previews only
    frame: int = 0
    name: str = "Scene"
    warnings: list[str] = field(default_factory=list)

    @property
    def triangle_positions(self) -> np.ndarray:
        """(T, 3, 3) float64 corner positions in world space."""
        return self.vertices[self.triangles]

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """World-space (min, max) of the triangles' corners, each (3,) float64. Needs at least one triangle."""
        used = self.vertices[np.unique(self.triangles)]
        return used.min(axis=0), used.max(axis=0)
