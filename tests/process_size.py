# SPDX-License-Identifier: GPL-3.0-or-later
"""How much this process holds: memory, and objects of its OpenGL context. For tests that look for leaks.

Standard library only: it is imported inside Blender too.
"""

import ctypes
import re
from pathlib import Path

MOST_NAMES = 1 << 15  # drivers number objects from 1 upwards and use numbers again


def resident_mib() -> float:
    """MiB of memory in use now. With a software driver this includes what the GPU holds."""
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+) kB", status)[1]) / 1024


def gpu_objects() -> dict[str, int]:
    """Textures, buffers and programs that live in the current OpenGL context and those that share with it."""
    library = ctypes.CDLL("libGL.so.1")
    counts = {}
    for kind in ("Texture", "Buffer", "Program"):
        lives = getattr(library, f"glIs{kind}")
        lives.argtypes, lives.restype = [ctypes.c_uint], ctypes.c_ubyte
        counts[kind.lower() + "s"] = sum(1 for name in range(1, MOST_NAMES) if lives(name))
    return counts
