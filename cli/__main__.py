# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of the command line outside Blender: ``python -I cli/__main__.py COMMAND …``.

The repository root is the package, whatever its folder is called, so it is loaded here under the name ``gridlight``
without touching ``sys.path``.
"""

import importlib.util
import signal
import sys
from pathlib import Path


def load_package():
    """The package ``gridlight`` from the folder above this file, registered in ``sys.modules``."""
    root = Path(__file__).resolve().parent.parent
    spec = importlib.util.spec_from_file_location(
        "gridlight", root / "__init__.py", submodule_search_locations=[str(root)])
    package = importlib.util.module_from_spec(spec)
    sys.modules["gridlight"] = package
    spec.loader.exec_module(package)
    return package


if __name__ == "__main__":
    # A shell starts background jobs with this one ignored; `kill -INT` is meant to work on them too.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        load_package()
        from gridlight.cli.main import main

        status = main(sys.argv[1:])
    except KeyboardInterrupt:  # before main could take it
        status = 130
    sys.exit(status)
