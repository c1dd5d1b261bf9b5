# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of the farm's commands: ``python -I farm/__main__.py COMMAND …``; docs/farm.md explains them.

``plan``, ``shard``, ``merge``, ``status`` and ``serve`` run in Blender's environment, ``run`` and ``worker`` in Dask's.
"""

import importlib.util
import sys
from pathlib import Path


def load_package():
    """The package ``gridlight`` from the folder above this one, by the command line's own start."""
    start = Path(__file__).resolve().parent.parent / "cli" / "__main__.py"
    spec = importlib.util.spec_from_file_location("gridlight_start", start)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.load_package()


if __name__ == "__main__":
    load_package()
    from gridlight.farm.commands import main

    sys.exit(main(sys.argv[1:]))
