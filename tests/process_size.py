# SPDX-License-Identifier: GPL-3.0-or-later
"""How much this process holds: memory, and objects of its OpenGL context. For tests that look for leaks.

Standard library only: it is imported inside Blender too.
"""

import contextlib
import ctypes
import gc
import os
import re
from pathlib import Path

_TBB_CLEAN_ALL_BUFFERS = 0  # oneapi/tbb/scalable_allocator.h
MOST_NAMES = 1 << 15  # drivers number objects from 1 upwards and use numbers again


def resident_mib() -> float:
    """MiB of memory in use now. With a software driver this includes what the GPU holds.

    What has been freed is given back to the system first, for how much of it an allocator keeps is a matter of chance.
    Pages of programs and libraries do not count: the system reads them in and drops them as it likes.
    """
    gc.collect()
    _give_back()
    return _resident_kib(Path("/proc/self/status").read_text()) / 1024


def _resident_kib(status: str) -> int:
    """From what /proc says of a process. Kernels of sandboxes may not tell its own memory from that of libraries."""
    sizes = dict(re.findall(r"^(\w+):\s+(\d+) kB$", status, re.MULTILINE))
    return int(sizes["RssAnon"]) + int(sizes["RssShmem"]) if "RssAnon" in sizes else int(sizes["VmRSS"])


def _give_back() -> None:
    ctypes.CDLL("libGL.so.1").glFinish()  # a driver keeps what it still works with
    ctypes.CDLL("libc.so.6").malloc_trim(0)
    with contextlib.suppress(OSError):  # no such library: nothing was put in malloc's place, as Debian's Blender does
        tbb = ctypes.CDLL("libtbbmalloc.so.2", mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        tbb.scalable_allocation_command(_TBB_CLEAN_ALL_BUFFERS, None)


def gpu_objects() -> dict[str, int]:
    """Textures, buffers and programs that live in the current OpenGL context and those that share with it."""
    library = ctypes.CDLL("libGL.so.1")
    counts = {}
    for kind in ("Texture", "Buffer", "Program"):
        lives = getattr(library, f"glIs{kind}")
        lives.argtypes, lives.restype = [ctypes.c_uint], ctypes.c_ubyte
        counts[kind.lower() + "s"] = sum(1 for name in range(1, MOST_NAMES) if lives(name))
    return counts
