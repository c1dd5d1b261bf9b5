# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: reads the arguments, runs one command, turns its outcome into an exit status and one JSON line.

A command is a module of this folder with

* ``HELP``: one line; ``NEEDS_BLENDER``, ``NEEDS_GPU``: what it runs on; the first may be a function of the arguments;
* ``add_arguments(parser, in_blender)``;
* ``run(args, reporter, should_stop) -> (summary, exit status)``: does the work; the summary is printed as JSON, below
  what ``reporter.result`` was given. What a command prints itself is lost: Blender's operators print to that stream;

and optionally ``check(args)``, quick checks that need no Blender, made before one is started.
"""

from __future__ import annotations

import errno
import importlib
import importlib.util
import json
import os
import signal
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path

from ..core.errors import Cancelled, GridlightError, InputError
from ..formats import staging
from ..formats.probe_metadata import program_version
from . import worker
from .arguments import Parser, join_signed_values
from .progress import Reporter

_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES)  # of a disk or its rights, not of ours


@dataclass(frozen=True)
class Family:
    """A set of commands: modules ``names`` of ``package``. Children run them by ``python -I start``."""

    package: str
    names: tuple[str, ...]
    program: str
    description: str
    start: Path


GRIDLIGHT = Family(
    package=__package__,
    names=("demo", "bake", "eval", "verify", "bench", "export", "info", "diff"),
    program="gridlight",
    description="Bakes grids of light probes on the GPU.",
    start=Path(__file__).with_name("__main__.py"),
)


class Stop:
    """Whether the user asked to stop. Called between steps of the work; also answers an interrupt during a wait."""

    def __init__(self):
        self.asked = False

    def __call__(self) -> bool:
        return self.asked

    def ask(self, _number=None, _frame=None):
        self.asked = True

    def interrupt(self, _number, _frame):
        """For work that may not ask for long. Python drops exceptions that are raised in destructors: then it is left
        to the next question."""
        self.asked = True
        raise KeyboardInterrupt


def main(argv: list[str], in_blender: bool = False, family: Family = GRIDLIGHT) -> int:
    """Runs one command line and returns its exit status. ``in_blender``: called by ``blender --command gridlight``."""
    child = worker.is_child()
    if child:
        worker.prepare_child()
    status = _guarded(argv, in_blender, child, family)
    if child:
        worker.leave(status)
    return status


def _guarded(argv: list[str], in_blender: bool, child: bool, family: Family) -> int:
    try:
        return _run(argv, in_blender, child, family)
    except Cancelled:
        _say("cancelled")
        return Cancelled.exit_status
    except KeyboardInterrupt:
        _say("cancelled")
        return Cancelled.exit_status
    except GridlightError as error:
        _say(str(error))
        return error.exit_status
    except BrokenPipeError:  # whoever read our output has enough
        _drop_output()
        return 0
    except SystemExit as end:  # argparse after --help; Blender must not end for it
        return int(end.code or 0)
    except MemoryError:
        _say("not enough memory for this; use a lower --resolution, --face or --memory")
        return InputError.exit_status
    except OSError as error:
        if error.errno not in _DISK_ERRORS:
            return _defect()
        if error.filename is None:
            _drop_output()
        what = f"read or write {error.filename}" if error.filename else "write standard output"
        _say(f"cannot {what}: {error.strerror}; make room, or use another place")
        return InputError.exit_status
    except Exception:  # whatever nobody expects
        return _defect()


def _defect() -> int:
    """Of ours: the one case in which a traceback helps the user, who can send it to us."""
    traceback.print_exc()
    _say("this is a defect of Gridlight; please report it with the lines above")
    return 1


def _drop_output() -> None:
    """What cannot be written now: Python would complain again when it flushes at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _run(argv: list[str], in_blender: bool, child: bool, family: Family) -> int:
    modules = _commands(argv, family)
    parser = _parser(modules, in_blender, family)
    args = parser.parse_args(join_signed_values(list(argv)))
    if args.command is None:
        raise InputError(f"name a command: {', '.join(modules)} ('{family.program} --help' explains them)")
    module = modules[args.command]
    if not child and hasattr(module, "check"):
        module.check(args)
    needs_blender = module.NEEDS_BLENDER(args) if callable(module.NEEDS_BLENDER) else module.NEEDS_BLENDER
    if needs_blender and not (in_blender or child):
        return _run_in_child(argv, args, module, family)
    stop = Stop()
    if child:
        worker.accept_interrupts(stop.ask)
    elif not in_blender:
        for number in worker.INTERRUPTS:
            signal.signal(number, stop.interrupt)
    reporter = Reporter(quiet=getattr(args, "quiet", False))
    try:
        summary, status = module.run(args, reporter, stop)
        reporter.finish()
    finally:
        reporter.abandon()
    worker.write_result("\n".join([*reporter.results, json.dumps(summary, allow_nan=False), ""]))
    return status


def _run_in_child(argv: list[str], args, module, family: Family) -> int:
    folder = getattr(args, "output", None)
    try:
        made = staging.missing_folders(folder) if folder else []
    except OSError as error:
        raise InputError(f"cannot write to {folder}: {error.strerror}; name another with -o") from None
    status, process = worker.run_in_child(argv, _say, module.NEEDS_GPU, args.verbose, family.start)
    if folder and status in (worker.DIED, Cancelled.exit_status):
        staging.remove_leftovers(folder, process, made)
    return status


def _commands(argv: list[str], family: Family) -> dict:
    """The command modules that this installation has, by name; only the one that ``argv`` starts with where it does."""
    available = [name for name in family.names if importlib.util.find_spec(f".{name}", family.package)]
    chosen = [name for name in available if argv[:1] == [name]]
    return {name: importlib.import_module(f".{name}", family.package) for name in chosen or available}


def _parser(modules: dict, in_blender: bool, family: Family) -> Parser:
    parser = Parser(prog=family.program, description=family.description)
    parser.add_argument("--version", action="version", version=f"Gridlight {program_version()}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    for name, module in modules.items():
        sub = subparsers.add_parser(name, help=module.HELP, description=module.HELP)
        module.add_arguments(sub, in_blender)
        if module.NEEDS_BLENDER:
            sub.add_argument("--verbose", action="store_true", help="show what Blender itself prints")
    return parser


def _say(text: str) -> None:
    print(f"gridlight: {text}", file=sys.stderr, flush=True)
