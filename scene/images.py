# SPDX-License-Identifier: GPL-3.0-or-later
"""Image datablocks as linear pixels, read once each and no larger than light transport can resolve."""

from __future__ import annotations

import weakref
from collections.abc import Callable

import bpy
import numpy as np

from ..core.kept import fingerprint
from ..core.snapshot import Image
from .image_interpolation import MOST_EDGE, finer_grid
from .notices import Notices

# A probe's texel sees a patch of surface, never a single pixel of a large texture: images are box-filtered down to this
# edge.
MAX_EDGE = 1024

_CHUNK_ROWS = 256  # rows converted at a time, so that an 8192² texture does not need its float copies all at once


def _decoded_srgb(steps: int) -> np.ndarray:
    """(steps,) float32 linear values of as many stored ones, 0..1 (IEC 61966-2-1)."""
    stored = np.arange(steps) / (steps - 1)
    return np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4).astype(np.float32)


_ENCODED = np.arange(256) / 255.0
_SRGB_TO_LINEAR, _FINE_TO_LINEAR = _decoded_srgb(256), _decoded_srgb(1 << 16)
_BYTE_TO_LINEAR = _ENCODED.astype(np.float32)


# Pixels made of what an image held, by image and node, as long as anybody uses them; None where none were worth making.
_made: dict[tuple, tuple[tuple, Callable[[], np.ndarray | None]]] = {}


class ImageTable:
    """Reads images and collects those that materials use, in the order of ``SceneSnapshot.images``."""

    def __init__(self, notices: Notices):
        self.images: list[Image] = []
        self._notices = notices
        self._pixels: dict[tuple, np.ndarray | None] = {}
        self._contents: dict[int, tuple] = {}
        self._stored: tuple[int, np.ndarray] | None = None  # what ``_encoded`` read last, by image
        self._channels: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._whole: dict[int, np.ndarray] = {}
        self._indices: dict[tuple[int, str], int] = {}

    def pixels(
        self, image: bpy.types.Image, user: str, interpolation: str = "Closest", extension: str = "REPEAT"
    ) -> np.ndarray | None:
        """(height, width, 4) float32 linear RGB (not premultiplied) and alpha; None, and a warning, where there are
        none.

        ``user`` names in the warning what wants the image, such as ``material 'Floor'``; ``interpolation`` and
        ``extension`` are those of the node that shows it.
        """
        key = image.as_pointer(), "", ""
        if key not in self._pixels:
            self._pixels[key] = self._read(image, user)
        if interpolation == "Closest" or self._pixels[key] is None or self._decoding(image) is not _SRGB_TO_LINEAR:
            return self._pixels[key]
        own = image.as_pointer(), interpolation, extension
        if own not in self._pixels:
            finer = self._kept(image, (interpolation, extension), lambda: self._interpolated(image, *own[1:]))
            self._pixels[own] = self._pixels[key] if finer is None else finer
        return self._pixels[own]

    def channels(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(height, width, 3) and (height, width, 1) views of ``pixels``, the same two objects every time."""
        key = id(pixels)
        if key not in self._channels:
            self._channels[key] = pixels[..., :3], pixels[..., 3:]
            for view in self._channels[key]:
                self._whole[id(view)] = pixels
        return self._channels[key]

    def whole(self, view: np.ndarray) -> np.ndarray | None:
        """The array of which ``view`` came from ``channels``, or None for pixels that were computed."""
        return self._whole.get(id(view))

    def add(self, name: str, pixels: np.ndarray, extension: str) -> int:
        """Index of ``pixels`` among the snapshot's images; the same array with the same extension is stored once."""
        key = (id(pixels), extension)  # the array is kept alive by the Image that holds it
        if key not in self._indices:
            self._indices[key] = len(self.images)
            self.images.append(Image(name, pixels, extension))
        return self._indices[key]

    def _read(self, image: bpy.types.Image, user: str) -> np.ndarray | None:
        if image.source == "TILED":
            self._notices.append(f"image '{image.name}' is tiled (UDIM): only its first tile is used")
        elif image.source in ("MOVIE", "SEQUENCE"):
            self._notices.append(f"image '{image.name}' is a {image.source.lower()}: only its current frame is used")
        size: tuple[int, int] = image.size  # asking for the size makes Blender load the file
        width, height = size
        if not (width and height and image.has_data):
            self._notices.append(
                f"image '{image.name}' of {user} is missing: the socket's own value is used instead; "
                "find it with File > External Data or pack it into the file"
            )
            return None
        table = self._decoding(image)
        return self._kept(image, (), lambda: self._linear(image, table))

    def _kept(
        self, image: bpy.types.Image, shown: tuple[str, ...], make: Callable[[], np.ndarray | None]
    ) -> np.ndarray | None:
        """What ``make`` makes of ``image`` for nodes that have it ``shown`` so; what it made in an earlier reading if
        the image holds the same and that is still in use."""
        key, content = (image.session_uid, *shown), self._content(image)
        if key in _made and _made[key][0] == content:
            self._stored = None
            return _made[key][1]()
        pixels = make()
        if pixels is None:
            _made[key] = content, lambda: None
        else:
            pixels.flags.writeable = False
            _made[key] = content, weakref.ref(pixels, lambda gone: _forget(key, gone))
        return pixels

    def _content(self, image: bpy.types.Image) -> tuple:
        """All that pixels are made of, asked once a reading."""
        key = image.as_pointer()
        if key not in self._contents:
            encoded = self._encoded(image)
            self._stored = key, encoded
            space = image.colorspace_settings
            how = image.alpha_mode, image.is_float, space.name, space.is_data
            self._contents[key] = *encoded.shape, *how, fingerprint(encoded)
        return self._contents[key]

    def _encoded(self, image: bpy.types.Image) -> np.ndarray:
        """(height, width, channels) float32 as Blender stores them, to be used up."""
        stored, self._stored = self._stored, None
        if stored is not None and stored[0] == image.as_pointer():
            return stored[1]
        size: tuple[int, int] = image.size
        encoded = np.empty((size[1], size[0], image.channels), np.float32)
        image.pixels.foreach_get(encoded.ravel())
        return encoded

    def _linear(self, image: bpy.types.Image, table: np.ndarray | None) -> np.ndarray:
        """(height, width, 4), decoded by ``table`` where there is one and box-filtered down to MAX_EDGE."""
        encoded = self._encoded(image)
        height, width = encoded.shape[:2]
        columns = min(width, max(1, round(width * min(1.0, MAX_EDGE / max(width, height)))))
        rows = min(height, max(1, round(height * min(1.0, MAX_EDGE / max(width, height)))))
        # A channel-packed fourth channel has nothing to do with the other three, and one of ones changes nothing.
        covers = image.alpha_mode != "CHANNEL_PACKED" and encoded.shape[2] == 4 and bool((encoded[..., 3] != 1).any())
        pixels = np.empty((height, columns, 4), np.float32)
        for start in range(0, height, _CHUNK_ROWS):
            band = _to_rgba(encoded[start : start + _CHUNK_ROWS], table, image)
            if covers:
                band[..., :3] *= band[..., 3:]  # filtered premultiplied: holes do not stain their rims
            pixels[start : start + _CHUNK_ROWS] = _box_filter(band, columns, axis=1)
        pixels = _box_filter(pixels, rows, axis=0)
        if covers:
            alpha = pixels[..., 3:]
            np.divide(pixels[..., :3], alpha, out=pixels[..., :3], where=alpha > 0)
        if table is not None or np.isfinite(pixels).all():  # bytes always are
            return pixels
        return np.nan_to_num(pixels, nan=0.0, posinf=0.0, neginf=0.0)

    def _interpolated(self, image: bpy.types.Image, interpolation: str, extension: str) -> np.ndarray | None:
        """The pixels of an opaque sRGB image with those between them; None where that makes no difference."""
        size: tuple[int, int] = image.size
        if max(size) > MOST_EDGE:  # not even read a second time
            return None
        encoded = self._encoded(image)
        if encoded.shape[2] == 4 and bool((encoded[..., 3] != 1).any()):
            return None
        finer = finer_grid(encoded[..., :3], _srgb_to_linear, interpolation, extension)
        if finer is None:
            return None
        rgb = _srgb_to_linear(finer)
        shrink = min(1.0, MAX_EDGE / max(rgb.shape[:2]))
        for axis in (1, 0):
            rgb = _box_filter(rgb, max(1, round(rgb.shape[axis] * shrink)), axis)
        pixels = np.ones((*rgb.shape[:2], 4), np.float32)
        pixels[..., :3] = rgb
        return pixels

    def _decoding(self, image: bpy.types.Image) -> np.ndarray | None:
        """Table from byte to linear value, or None where Blender hands out linear values already."""
        if image.is_float:
            return None
        space = image.colorspace_settings
        if space.is_data or space.name.startswith(("Linear", "scene_linear", "ACEScg")):
            return _BYTE_TO_LINEAR
        if space.name != "sRGB":
            self._notices.append(f"image '{image.name}' has colour space '{space.name}': it is read as sRGB")
        return _SRGB_TO_LINEAR


def _forget(key: tuple, gone: weakref.ref) -> None:
    if key in _made and _made[key][1] is gone:
        del _made[key]


def _srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """float32 0..1 decoded."""
    return _FINE_TO_LINEAR.take((values * 65535.0 + 0.5).astype(np.uint16), mode="clip")


def _to_rgba(encoded: np.ndarray, table: np.ndarray | None, image: bpy.types.Image) -> np.ndarray:
    """(rows, width, channels) as Blender stores them to linear straight RGBA. ``encoded`` is used up."""
    channels, has_alpha = encoded.shape[2], encoded.shape[2] == 4 and image.alpha_mode != "NONE"
    if table is not None:  # bytes, which Blender hands out as shares of 255
        encoded *= np.float32(255.0)
        encoded += np.float32(0.5)
        byte = encoded.astype(np.uint8)
        decoded = table.take(byte, mode="clip")  # no need to check bounds, and faster than an index
        alpha = _BYTE_TO_LINEAR.take(byte[..., 3:], mode="clip") if has_alpha else np.float32(1.0)
    else:
        decoded = encoded
        alpha = encoded[..., 3:].copy() if has_alpha else np.float32(1.0)
        if has_alpha and image.alpha_mode != "CHANNEL_PACKED":  # float images are stored premultiplied
            np.divide(decoded[..., :3], alpha, out=decoded[..., :3], where=alpha > 0)
    if channels == 4:
        rgba = decoded
    else:
        rgba = np.empty((*encoded.shape[:2], 4), np.float32)
        rgba[..., :3] = decoded if channels == 3 else decoded[..., :1]
    rgba[..., 3:] = alpha
    return rgba


def _box_filter(pixels: np.ndarray, size: int, axis: int) -> np.ndarray:
    """Exact area average along ``axis`` down to ``size`` samples; fractional edges take their share."""
    length = pixels.shape[axis]
    if size >= length:
        return pixels
    sums = np.cumsum(pixels, axis=axis, dtype=np.float64)
    sums = np.concatenate([np.zeros_like(np.take(sums, [0], axis)), sums], axis)
    edges = np.linspace(0, length, size + 1)
    whole = np.minimum(edges.astype(int), length - 1)
    shape = [1] * pixels.ndim
    shape[axis] = -1
    at_edges = np.take(sums, whole, axis) + (edges - whole).reshape(shape) * np.take(pixels, whole, axis)
    return (np.diff(at_edges, axis=axis) * (size / length)).astype(np.float32)
