# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures and floors of the demo gallery, painted by arithmetic.

Every painting is a pure function of its size: (height, width, 3) float, sRGB-encoded 0..1, row 0 at the bottom, the
same bytes on every run. ``packed_image`` turns one into a Blender image that travels inside the .blend.
"""

from __future__ import annotations

import bpy
import numpy as np

WHITEST = 0.92  # sRGB-encoded: 0.83 linear, about what white paint reflects


def packed_image(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """A packed byte image of sRGB ``pixels`` (height, width, 3), row 0 at the bottom; nothing in it is above
    WHITEST."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = np.clip(pixels, 0, WHITEST)
    image.pixels.foreach_set(rgba.ravel())
    image.update()
    image.pack()
    return image


def value_noise(shape: tuple[int, int], cells: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """(height, width) smooth noise in 0..1 that wraps around; ``cells`` knots along y and x."""
    knots = rng.random(cells)
    y, x = (np.arange(size) * count / size for size, count in zip(shape, cells))
    y0, x0 = y.astype(int), x.astype(int)
    fade_y, fade_x = ((f * f * (3 - 2 * f)) for f in (y - y0, x - x0))
    y1, x1 = (y0 + 1) % cells[0], (x0 + 1) % cells[1]
    low = knots[np.ix_(y0, x0)] * (1 - fade_x) + knots[np.ix_(y0, x1)] * fade_x
    high = knots[np.ix_(y1, x0)] * (1 - fade_x) + knots[np.ix_(y1, x1)] * fade_x
    return low * (1 - fade_y[:, None]) + high * fade_y[:, None]


def fractal_noise(shape: tuple[int, int], cells: tuple[int, int], octaves: int, rng: np.random.Generator) -> np.ndarray:
    """(height, width) sum of ``octaves`` of value noise, 0..1."""
    total, weight = np.zeros(shape), 0.0
    for octave in range(octaves):
        total += value_noise(shape, (cells[0] << octave, cells[1] << octave), rng) / 2**octave
        weight += 1 / 2**octave
    return total / weight


def _smooth(low: float, high: float, value: np.ndarray) -> np.ndarray:
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _mix(a: np.ndarray, b, share: np.ndarray) -> np.ndarray:
    return a + (np.asarray(b) - a) * share[..., None]


def _canvas(picture: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """``picture`` with brush grain and the weave of its canvas."""
    height, width = picture.shape[:2]
    strokes = fractal_noise((height, width), (48, 12), 3, rng) - 0.5
    y, x = np.mgrid[:height, :width]
    weave = 0.5 * np.sin(x * 1.7) * np.sin(y * 1.7)
    return np.clip(picture * (1 + 0.16 * strokes + 0.03 * weave)[..., None], 0, 1)


def ridges_at_dusk(height: int = 448, width: int = 768) -> np.ndarray:
    """Receding mountain ridges under a low sun, mirrored in a lake."""
    rng = np.random.default_rng(2007)
    y, x = np.mgrid[:height, :width] / np.array([height, height])[:, None, None]
    shore = 0.26
    up = np.where(y < shore, shore + (shore - y) * 1.5, y)  # the lake mirrors what stands above it
    sky = _mix(np.full((height, width, 3), (0.98, 0.72, 0.36)), (0.93, 0.40, 0.30), _smooth(0.35, 0.62, up))
    sky = _mix(sky, (0.36, 0.20, 0.42), _smooth(0.55, 0.85, up))
    sky = _mix(sky, (0.10, 0.11, 0.30), _smooth(0.75, 1.05, up))
    clouds = fractal_noise((height, width), (10, 3), 5, rng)
    sky = _mix(sky, (1.0, 0.63, 0.45), 0.55 * _smooth(0.52, 0.75, clouds) * _smooth(0.4, 0.7, up))
    from_sun = np.hypot(x - 1.16, up - 0.66)
    sky = _mix(sky, (1.0, 0.86, 0.52), 0.75 * np.exp(-((from_sun / 0.22) ** 2)))
    picture = _mix(sky, (1.0, 0.96, 0.78), 1 - _smooth(0.072, 0.078, from_sun))
    far, near = np.array((0.72, 0.42, 0.46)), np.array((0.07, 0.07, 0.17))
    for layer in range(6):
        depth = layer / 5
        shape = fractal_noise((1, width), (1, 3 + layer), 6, rng)[0]
        crest = 0.60 - 0.055 * layer + (shape - 0.5) * (0.34 - 0.03 * layer)
        crest = np.maximum(crest, shore + 0.004)
        inside = 1 - _smooth(-0.003, 0.003, up - crest[None])
        mist = np.clip((crest[None] - up) / 0.22, 0, 1)
        tone = (far * (1 - depth) + near * depth) + (1 - mist)[..., None] * 0.05 * (1 - depth)
        picture = picture + (tone - picture) * inside[..., None]
    ripple = fractal_noise((height, width), (96, 6), 2, rng) - 0.5
    water = y < shore
    lake = _mix(picture, (0.16, 0.15, 0.30), np.full((height, width), 0.30)) * (1 + 0.7 * ripple)[..., None]
    glitter = np.exp(-(((x - 1.16) / 0.09) ** 2)) * _smooth(0.08, 0.25, ripple)
    lake = _mix(lake, (1.0, 0.83, 0.5), glitter)
    return _canvas(np.where(water[..., None], lake, picture), rng)


def rings(height: int = 512, width: int = 512) -> np.ndarray:
    """Interlocking discs cut into coloured quadrants."""
    rng = np.random.default_rng(1912)
    palette = np.array(
        [
            (0.86, 0.16, 0.12),
            (0.97, 0.70, 0.12),
            (0.07, 0.28, 0.55),
            (0.95, 0.90, 0.78),
            (0.06, 0.45, 0.40),
            (0.93, 0.45, 0.10),
            (0.10, 0.10, 0.14),
            (0.55, 0.70, 0.78),
            (0.62, 0.10, 0.25),
        ]
    )
    y, x = np.mgrid[:height, :width] / max(height, width)
    warp = 0.006 * (fractal_noise((height, width), (6, 6), 3, rng) - 0.5)
    picture = np.full((height, width, 3), (0.92, 0.86, 0.72))
    discs = [(0.30, 0.68, 0.40), (0.74, 0.30, 0.36), (0.72, 0.78, 0.24), (0.22, 0.22, 0.25)]
    for cx, cy, size in discs:
        radius = np.hypot(x - cx, y - cy) + warp
        angle = np.arctan2(y - cy, x - cx) + 0.35
        ring = (radius / size * 6).astype(int)
        quadrant = np.floor(angle / (np.pi / 2)).astype(int) % 4
        pick = rng.integers(0, len(palette), (7, 4))
        colour = palette[pick[np.clip(ring, 0, 6), quadrant]]
        picture = np.where((radius < size)[..., None], colour, picture)
    return _canvas(picture, rng)


def tide(height: int = 640, width: int = 448) -> np.ndarray:
    """Bands of poured colour, folded by a warped noise."""
    rng = np.random.default_rng(88)
    shape = (height, width)
    fold_x, fold_y = (fractal_noise(shape, (4, 3), 4, rng) - 0.5 for _ in range(2))
    y, x = np.mgrid[:height, :width] / height
    flow = y * 2.1 + 0.5 * np.sin(5.0 * (x + 1.3 * fold_x)) + 2.1 * fold_y
    stops = np.array(
        [
            (0.03, 0.10, 0.20),
            (0.02, 0.30, 0.42),
            (0.10, 0.55, 0.58),
            (0.90, 0.86, 0.74),
            (0.93, 0.62, 0.22),
            (0.70, 0.20, 0.14),
            (0.20, 0.06, 0.12),
        ]
    )
    where = np.mod(flow, 1.0) * len(stops)
    low = where.astype(int) % len(stops)
    share = _smooth(0.35, 0.65, where - where.astype(int))
    picture = stops[low] + (stops[(low + 1) % len(stops)] - stops[low]) * share[..., None]
    vein = 1 - _smooth(0.0, 0.05, np.abs(np.mod(flow * 3.5, 1.0) - 0.5))
    return _canvas(_mix(picture, (0.98, 0.85, 0.50), 0.45 * vein), rng)


def oak_parquet(size: int = 512) -> np.ndarray:
    """Herringbone of oak staves; tiles seamlessly."""
    rng = np.random.default_rng(11)
    stave, ratio = size // 16, 4  # a stave is stave × ratio·stave texels
    y, x = np.mgrid[:size, :size]
    u, v = x // stave, y // stave
    # In cells of one stave's width: the pattern repeats every 2·ratio along each axis, shifted by one per row.
    phase = (u - v) % (2 * ratio)
    lying = phase < ratio
    start = np.where(lying, u - phase, v - (2 * ratio - 1 - phase))
    across = np.where(lying, v, u)
    key = (np.where(lying, 0, 1) * 4099 + (start % 16) * 131 + (across % 16) * 17) % 8191
    tone = rng.random(8191)[key]
    grain_x, grain_y = fractal_noise((size, size), (128, 8), 2, rng), fractal_noise((size, size), (8, 128), 2, rng)
    grain = np.where(lying, grain_x, grain_y)
    wood = np.array((0.60, 0.43, 0.27)) * (0.84 + 0.22 * tone + 0.16 * (grain - 0.5))[..., None]
    along = np.where(lying, x - start * stave, y - start * stave)
    side = np.where(lying, y % stave, x % stave)
    joint = (side < 1) | (along % (ratio * stave) < 1)
    return np.where(joint[..., None], wood * 0.6, wood)


def stone_tiles(size: int = 512) -> np.ndarray:
    """Pale and grey-green stone squares laid as a chequer, two by two tiles."""
    rng = np.random.default_rng(5)
    y, x = np.mgrid[:size, :size]
    half = size // 2
    dark = ((x // half) + (y // half)) % 2 == 1
    cloud = fractal_noise((size, size), (8, 8), 5, rng)
    vein = np.abs(fractal_noise((size, size), (4, 4), 5, rng) - 0.5)
    pale = np.array((0.86, 0.83, 0.77)) * (0.93 + 0.12 * cloud - 0.10 * (1 - _smooth(0.0, 0.03, vein)))[..., None]
    grey = np.array((0.50, 0.53, 0.49)) * (0.88 + 0.20 * cloud + 0.12 * (1 - _smooth(0.0, 0.02, vein)))[..., None]
    joint = (x % half < 2) | (y % half < 2)
    stone = np.where(dark[..., None], grey, pale)
    return np.where(joint[..., None], stone * 0.75, stone)
