# SPDX-License-Identifier: GPL-3.0-or-later
"""The system libraries that Blender needs for a GPU context without a window: are they there, and how to get them.

Standard library only and no relative import, because the launcher also runs this file as a script.
"""

import ctypes
import glob
import os
import shutil
import subprocess
import sys

# What the bpy wheels link to or open at run time, with the package that carries it on Debian and Ubuntu.
LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXi.so.6": "libxi6",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libXrender.so.1": "libxrender1",
    "libXfixes.so.3": "libxfixes3",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
}
# libEGL only dispatches: one of these has to be there to do the work.
EGL_VENDORS = ("libEGL_mesa.so.0", "libEGL_nvidia.so.0")
# Mesa's drivers (llvmpipe among them): one file each in a folder, or all in one library since Mesa 24.2.
MESA_DRIVERS = (
    "/usr/lib/*/dri/*_dri.so",
    "/usr/lib64/dri/*_dri.so",
    "/usr/lib/dri/*_dri.so",
    "/usr/lib/*/libgallium-*.so",
    "/usr/lib64/libgallium-*.so",
    "/usr/lib/libgallium-*.so",
)


def missing_packages() -> list[str]:
    """Debian's names of the packages without which no context can be made here; empty where all is well."""
    packages = [package for library, package in LIBRARIES.items() if not _loads(library)]
    if not any(_loads(vendor) for vendor in EGL_VENDORS):
        packages.append("libegl-mesa0")
    if not _loads("libEGL_nvidia.so.0") and not any(glob.glob(pattern) for pattern in MESA_DRIVERS):
        packages.append("libgl1-mesa-dri")
    return packages


def install_command(packages) -> str:
    """The one command that installs ``packages`` on Debian and Ubuntu."""
    return f"apt-get update && apt-get install -y --no-install-recommends {' '.join(packages)}"


def ensure(say) -> str | None:
    """Makes the libraries available where that can be done.

    Installs them when this is root on a system with apt-get, telling ``say`` (a function of one string) first.
    Returns None when all are there, else one line with the remedy.
    """
    if not sys.platform.startswith("linux"):
        return None
    packages = missing_packages()
    if not packages:
        return None
    command = install_command(packages)
    if shutil.which("apt-get") is None:
        return (
            "system libraries for a GPU context are missing; install with your package manager what Debian calls "
            f"{', '.join(packages)}"
        )
    if os.geteuid() != 0:
        return f"system libraries for a GPU context are missing; install them with: sudo sh -c '{command}'"
    say(f"installing system libraries for a GPU context: {command}")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    install = ["apt-get", "-qq", "install", "-y", "--no-install-recommends", *packages]
    for step in (["apt-get", "-qq", "update"], install):
        if subprocess.run(step, check=False, env=environment, stdin=subprocess.DEVNULL, stdout=2).returncode != 0:
            return f"'{' '.join(step)}' failed (see above); repair it, then run: {command}"
    still = missing_packages()
    return f"system libraries are still missing after the installation: {', '.join(still)}" if still else None


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


if __name__ == "__main__":
    problem = ensure(lambda text: print(f"gridlight: {text}", file=sys.stderr, flush=True))
    if problem:
        print(f"gridlight: {problem}", file=sys.stderr)
        sys.exit(3)
