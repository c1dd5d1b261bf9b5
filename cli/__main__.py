# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of the command line outside Blender: ``python -I cli/__main__.py COMMAND …``.

The repository root is the package, whatever its folder is called, so it is loaded here under the name ``gridlight``
without touching ``sys.path``.
"""

import os
import signal


def leave_at_once(_number, _frame):
    """For interrupts before a command has begun: an exception would end as a traceback from the middle of an import."""
    os.write(2, b"gridlight: cancelled\n")
    os._exit(130)


if __name__ == "__main__":
    # Set first and explicitly: a shell starts background jobs with SIGINT ignored, and `kill -INT` is to work on them.
    signal.signal(signal.SIGINT, leave_at_once)
    signal.signal(signal.SIGTERM, leave_at_once)

import importlib.util
import sys
from pathlib import Path


def load_package():
    """The package ``gridlight`` from the folder above this file, registered in ``sys.modules``."""
    root = Path(__file__).resolve().parent.parent
    spec = importlib.util.spec_from_file_location(
        "gridlight", root / "__init__.py", submodule_search_locations=[str(root)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules["gridlight"] = package
    spec.loader.exec_module(package)
    return package


if __name__ == "__main__":
    load_package()
    from gridlight.cli.main import main

    sys.exit(main(sys.argv[1:]))
