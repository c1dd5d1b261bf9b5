# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe file: one OpenEXR file per volume, exact in both directions, readable by any EXR reader.

32-bit float, ZIP, one part of scanlines, width nx, height ny·nz, row = j + ny·k. Channels, B bands::

    L00.R L00.G L00.B … L33.B   radiance coefficients by band and order, B² of them
    state                       0 culled, 1 active, 2 invalid
    validity                    0..1
    offset.X .Y .Z              capture position minus node, metres
    depth.mean.00 … .63         mean distance per octahedral texel, metres
    depth.meansq.00 … .63       mean squared distance, metres²
    depth.normal.00 … .63       normal, on the probe's side, of what is in a texel's middle: 2047 times its octahedral
                                coordinates, to whole numbers, plus 2048, the second times 4096; the background faces
                                the probe; 0: not known
    depth.middle.00 … .63       distance of that, metres (both: format 1.2; a file without counts as 0)
    dX.L00.R … dZ.L22.B         change of the coefficients that irradiance needs, up to the third band, per metre along
                                the world's axes: first along X, then Y, then Z (format 1.1; a file without counts as 0)

The text attribute ``gridlight`` is one JSON object: what the channels cannot say (see ``describe``), and ``digest``,
the SHA-256 of that object without the digest and of all channel bytes, so a damaged file is noticed wherever the
damage is. A file without ``digest`` is accepted: other programs may write one.
"""

from __future__ import annotations

import hashlib
import json
import os

import numpy as np

from ..core.conventions import ACTIVE, CULLED, DEPTH_EDGE, FORMAT_VERSION, INVALID, MAX_BANDS, coefficient_names
from ..core.errors import InputError
from ..core.field import Field
from ..core.gradients import gradient_bands
from ..core.grid import Grid
from . import openexr_file
from .openexr_file import reason

ATTRIBUTE = "gridlight"
MAX_BYTES = 3 << 29  # of pixels; a reader that checks the header first never allocates more
_MOST_COMPRESSION = 1100  # no stream of deflate, which ZIP is, gives more than 1032 times its size
DEPTH_TEXELS = DEPTH_EDGE * DEPTH_EDGE
# Not in files before format 1.2.
MIDDLE_NAMES = [f"depth.{what}.{texel:02d}" for what in ("normal", "middle") for texel in range(DEPTH_TEXELS)]
CONVENTIONS = {
    "space": "right-handed, Z up, metres",
    "order": "x fastest, then y, then z; row = j + ny*k",
    "coefficients": "radiance, scene-linear Rec. 709 RGB",
    "basis": "real orthonormal spherical harmonics without the Condon-Shortley phase, index l(l+1)+m",
    "irradiance": "sum of A_l L_lm Y_lm(n), A = pi, 2pi/3, pi/4, 0",
    "matrix": "rows; box frame -1..1 to world",
    "gradient": "of coefficients per metre, world axes",
    "depth": f"octahedral map of {DEPTH_EDGE}x{DEPTH_EDGE} texels, row-major",
}


def channel_names(bands: int) -> list[str]:
    """All channels in the order in which ``_planes`` holds them."""
    names = [f"{name}.{color}" for name in coefficient_names(bands) for color in "RGB"]
    names += ["state", "validity", "offset.X", "offset.Y", "offset.Z"]
    for statistic in ("mean", "meansq"):
        names += [f"depth.{statistic}.{texel:02d}" for texel in range(DEPTH_TEXELS)]
    return names + gradient_names(bands) + MIDDLE_NAMES


def gradient_names(bands: int) -> list[str]:
    """Channels that files of format 1.0 do not have."""
    names = coefficient_names(gradient_bands(bands))
    return [f"d{axis}.{name}.{color}" for axis in "XYZ" for name in names for color in "RGB"]


def _pixel_bytes(grid: Grid, bands: int) -> int:
    return grid.count * len(channel_names(bands)) * 4


def check_size(grid: Grid, bands: int) -> None:
    """Raises InputError where a field of ``grid`` is too large for one file; cheap, made before the long work."""
    size = _pixel_bytes(grid, bands)
    if size > MAX_BYTES:
        raise InputError(
            f"{grid.name}: {grid.count} probes need {size >> 20} MiB in one probe file, the limit is "
            f"{MAX_BYTES >> 20} MiB; use a lower resolution, fewer bands or several volumes"
        )


def describe(field: Field) -> dict:
    """The JSON object of a file: ``field.metadata`` with what follows from the field itself."""
    return {
        **{key: value for key, value in field.metadata.items() if key != "digest"},
        "format_version": list(FORMAT_VERSION),
        "volume": {"name": field.grid.name, "matrix": np.asarray(field.grid.matrix, float).tolist()},
        "resolution": list(field.grid.resolution),
        "bands": field.bands,
        "conventions": CONVENTIONS,
    }


def write(path, field: Field) -> None:
    """Writes ``field`` to ``path``; the same field gives the same bytes.

    Raises:
        InputError: the field holds values that are not finite, or is too large for one file.
        OSError: the file cannot be written.
    """
    import OpenEXR

    check_size(field.grid, field.bands)
    text = _json(describe(field))
    digest = hashlib.sha256(text.encode())
    nx, ny, nz = field.grid.resolution
    planes = {}
    for name, column in zip(channel_names(field.bands), _columns(field)):
        plane = np.ascontiguousarray(column, "<f4")
        if not np.isfinite(plane).all():
            raise InputError(f"{field.grid.name}: channel {name} holds values that are not finite; nothing was written")
        digest.update(plane)
        planes[name] = plane.reshape(ny * nz, nx)
    document = {**json.loads(text), "digest": digest.hexdigest()}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, ATTRIBUTE: _json(document)}
    openexr_file.write(path, header, planes)


def read(path) -> Field:
    """The field in the file at ``path``.

    Raises:
        InputError: no probe file, a newer format, a truncated or damaged file, values that are not finite, or a size
            beyond the limit. Nothing large is allocated before the header has been checked.
    """
    import OpenEXR

    path = os.fspath(path)
    try:
        with open(path, "rb") as file:
            magic = file.read(4)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}; name a probes.exr that Gridlight wrote") from None
    if magic != b"\x76\x2f\x31\x01":
        raise InputError(f"{path} is not an OpenEXR file; name a probes.exr that Gridlight wrote")
    try:
        with openexr_file.silent():
            document, grid, bands = _check_header(path, OpenEXR.File(path, header_only=True).header())
            return _take(path, OpenEXR.File(path, separate_channels=True).channels(), document, grid, bands)
    except (RuntimeError, ValueError, TypeError, OverflowError, UnicodeDecodeError) as error:
        # What OpenEXR's binding raises for files that end early or contradict themselves.
        raise InputError(f"{path} is truncated or damaged ({reason(error)}); bake it again or restore a copy") from None


def _columns(field: Field) -> list[np.ndarray]:
    """Views of ``field`` in the order of ``channel_names``, (P,) each; the one place that knows where what is."""
    columns = list(field.coefficients.reshape(field.grid.count, -1).T)
    columns += [field.state, field.validity, *field.offset.T]
    columns += [*field.depth[:, :, 0].T, *field.depth[:, :, 1].T]
    columns += list(field.gradient.reshape(field.grid.count, -1).T)
    return columns + [*field.depth[:, :, 2].T, *field.depth[:, :, 3].T]


def _check_header(path: str, header: dict) -> tuple[dict, Grid, int]:
    """The JSON object, grid and bands that an EXR header announces, all consistent with its window and channels."""
    text = header.get(ATTRIBUTE)
    if not isinstance(text, str):
        raise InputError(f"{path} is an OpenEXR image without Gridlight's data; name a probes.exr that Gridlight wrote")
    try:
        document = json.loads(text)
    except ValueError:
        raise InputError(f"{path} is damaged: its 'gridlight' attribute is not JSON") from None
    if not isinstance(document, dict):
        raise InputError(f"{path} is damaged: its 'gridlight' attribute is not a JSON object")
    version = document.get("format_version")
    if not (isinstance(version, list) and len(version) == 2 and all(type(part) is int for part in version)):
        raise InputError(f"{path} is damaged: its format version is missing")
    if version[0] > FORMAT_VERSION[0]:
        raise InputError(
            f"{path} has format version {version[0]}.{version[1]}, this Gridlight reads up to "
            f"{FORMAT_VERSION[0]}; update Gridlight"
        )
    grid, bands = _announced_grid(path, document)
    _check_memory(path, _pixel_bytes(grid, bands))
    low, high = (np.asarray(corner, np.int64) for corner in header["dataWindow"])
    nx, ny, nz = grid.resolution
    if tuple(high - low + 1) != (nx, ny * nz):
        width, height = high - low + 1
        raise InputError(f"{path} is damaged: {width}×{height} pixels for a resolution of {nx},{ny},{nz}")
    present = {channel.name for channel in header["channels"]}
    missing = [name for name in _expected_names(bands, present) if name not in present]
    if missing:
        raise InputError(f"{path} is damaged or incomplete: channel {missing[0]} is missing ({len(missing)} in all)")
    _check_memory(path, 4 * grid.count * len(present))
    return document, grid, bands


def _expected_names(bands: int, present) -> list[str]:
    """The channels that a file with the channels ``present`` must have: gradients all or none, and so what is in
    the middle of texels."""
    absent: set[str] = set()
    for names in (gradient_names(bands), MIDDLE_NAMES):
        if not any(name in present for name in names):
            absent.update(names)
    return [name for name in channel_names(bands) if name not in absent]


def _check_memory(path: str, pixel_bytes: int) -> None:
    """Refuses, before anything is allocated, pixels that are too many or that so small a file cannot hold."""
    if pixel_bytes > MAX_BYTES:
        raise InputError(f"{path} announces {pixel_bytes >> 20} MiB of channels; the limit is {MAX_BYTES >> 20} MiB")
    size = os.path.getsize(path)
    if pixel_bytes > _MOST_COMPRESSION * size:
        raise InputError(f"{path} is truncated or damaged: its {size} bytes cannot hold {pixel_bytes} bytes of probes")


def _announced_grid(path: str, document: dict) -> tuple[Grid, int]:
    try:
        matrix = np.array(document["volume"]["matrix"], float)
        name = document["volume"]["name"]
        resolution = tuple(document["resolution"])
        bands = document["bands"]
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path} is damaged: its description of the volume is incomplete ({reason(error)})") from None
    whole = all(type(number) is int for number in (*resolution, bands)) and 1 <= bands <= MAX_BANDS
    if matrix.shape != (4, 4) or len(resolution) != 3 or not whole or not isinstance(name, str):
        raise InputError(f"{path} is damaged: its volume, resolution or bands make no sense")
    try:
        return Grid(matrix, resolution, name), bands
    except InputError as error:
        raise InputError(f"{path} is damaged: {error}") from None


def _take(path: str, channels: dict, document: dict, grid: Grid, bands: int) -> Field:
    """The field that ``channels`` hold, which are let go one by one: the whole is in memory once, not twice."""
    nx, ny, nz = grid.resolution
    digest_stated = document.pop("digest", None)
    digest = hashlib.sha256(_json(document).encode())
    field = Field.empty(grid, bands)
    field.metadata = document
    columns = dict(zip(channel_names(bands), _columns(field)))
    for name in _expected_names(bands, channels):
        column = columns[name]
        pixels = channels.pop(name).pixels
        if pixels.dtype != np.float32 or pixels.shape != (ny * nz, nx):
            shown = f"{pixels.dtype} {pixels.shape}"
            raise InputError(f"{path} is damaged: channel {name} is {shown}, not 32-bit float ({ny * nz}, {nx})")
        if not np.isfinite(pixels).all():
            raise InputError(f"{path}: channel {name} holds values that are not finite; bake it again")
        if name == "state" and not np.isin(pixels, (CULLED, ACTIVE, INVALID)).all():
            raise InputError(f"{path} is damaged: its probe states are not {CULLED}, {ACTIVE} or {INVALID}")
        digest.update(np.ascontiguousarray(pixels, "<f4"))
        column[:] = pixels.ravel()
    if digest_stated is not None and digest_stated != digest.hexdigest():
        raise InputError(
            f"{path} does not match its own checksum: it was damaged or edited; bake it again "
            "(or remove 'digest' from its 'gridlight' attribute to use it as it is)"
        )
    return field


def _json(document: dict) -> str:
    return json.dumps(document, allow_nan=False, sort_keys=True, separators=(",", ":"))
