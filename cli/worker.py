# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one command in a child process, because Blender ends the whole process where no GPU driver works.

The parent never imports bpy. It starts the child with this module's ``prepare_child``, forwards interrupts, and turns a
death by signal into one plain line. Three descriptors go to the child:

* its standard output belongs to the command's result alone and its standard error to our own lines: whatever Blender
  prints, from C or through ``sys.stdout``, goes to the log instead;
* ``status``: the child writes the name of every milestone it has passed (see ``milestone``);
* ``log``: an unnamed file that takes the C-level chatter, shown with --verbose or when the child dies.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from . import system_libraries

DESCRIPTORS = "GRIDLIGHT_WORKER_DESCRIPTORS"
CONTEXT_READY = "context"
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)
PATIENCE_SECONDS = 3.0  # a step of the bake on a slow device may take longer
LOG_TAIL = 4000  # characters of Blender's chatter worth showing after a crash

DIED = 3  # exit status of a command whose child was ended by a signal

_status_descriptor: int | None = None
_result_stream = None  # of a child; elsewhere results go to sys.stdout


def is_child() -> bool:
    return DESCRIPTORS in os.environ


def milestone(name: str) -> None:
    """Tells the parent, if there is one, that ``name`` has been passed."""
    if _status_descriptor is not None:
        os.write(_status_descriptor, f"{name}\n".encode())


def prepare_child() -> None:
    """Sets up this process as the child: descriptors, interrupts, and its end when the parent ends."""
    global _status_descriptor, _result_stream
    _status_descriptor, log, parent_alive = map(int, os.environ.pop(DESCRIPTORS).split(","))
    sys.stdout.flush()
    sys.stderr.flush()
    output, errors = os.dup(1), os.dup(2)
    os.dup2(log, 1)
    os.dup2(log, 2)
    _result_stream = open(output, "w", encoding="utf-8", errors="backslashreplace")
    sys.stderr = open(errors, "w", encoding="utf-8", errors="backslashreplace", buffering=1)
    faulthandler.enable(log)
    threading.Thread(target=_end_with_parent, args=(parent_alive,), daemon=True).start()


def _end_with_parent(parent_alive: int) -> None:
    # The parent holds the other end of this pipe and never writes: reading returns when the parent is gone.
    os.read(parent_alive, 1)
    os.kill(os.getpid(), signal.SIGTERM)


def write_result(text: str) -> None:
    """Writes ``text`` to the standard output that the user sees, below whatever Blender has printed."""
    stream = _result_stream or sys.stdout
    if _result_stream is None:
        # In a pipe, what C has printed waits until the process ends: Blender's banner would come last.
        stream.flush()
        ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None).fflush(None)
    stream.write(text)
    stream.flush()


def accept_interrupts(handler) -> None:
    """From here on ``handler`` gets the interrupts; the parent held them back while this process started."""
    for number in INTERRUPTS:
        signal.signal(number, handler)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)


def leave(status: int) -> None:
    """Ends the child at once: the wheels can hang when the interpreter shuts down."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            pass  # the reader has left; nobody misses these lines
    os._exit(status)


def run_in_child(argv: list[str], say, needs_gpu: bool, verbose: bool, start: Path) -> tuple[int, int]:
    """Runs ``argv`` in a child that begins with ``start``. Returns (exit status, child's process id); ``say`` prints
    one line for the user."""
    if sys.platform == "win32":  # neither process groups nor held-back signals
        say("on Windows this command runs inside Blender: blender -b FILE.blend --command gridlight COMMAND …")
        return 2, 0
    problem = system_libraries.ensure(say)
    if problem:
        say(problem)
        return 3, 0
    status_read, status_write = os.pipe()
    alive_read, alive_write = os.pipe()
    with tempfile.TemporaryFile() as log:
        # Held back here and, inherited, in the child until each has its handler: none is lost, none is a traceback.
        signal.pthread_sigmask(signal.SIG_BLOCK, INTERRUPTS)
        # A process group of its own: Ctrl-C on a terminal reaches only this process, which forwards it exactly once.
        child = subprocess.Popen(
            [sys.executable, "-I", str(start), *argv],
            env={**os.environ, DESCRIPTORS: f"{status_write},{log.fileno()},{alive_read}"},
            pass_fds=(status_write, log.fileno(), alive_read),
            stdin=subprocess.DEVNULL,
            process_group=0,
        )
        os.close(status_write)
        os.close(alive_read)
        interrupts = _forward_interrupts(child)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, INTERRUPTS)
        code = child.wait()
        os.close(alive_write)
        with os.fdopen(status_read, encoding="utf-8") as status:
            milestones = status.read().split()
        log.seek(0)
        chatter = log.read().decode("utf-8", "replace").strip()
    if verbose and chatter:
        print(chatter, file=sys.stderr)
    if code >= 0:
        return code, child.pid
    if interrupts:
        say("cancelled")
        return 130, child.pid
    before_context = needs_gpu and CONTEXT_READY not in milestones
    if chatter and not verbose and not before_context:
        print(chatter[-LOG_TAIL:], file=sys.stderr)
    say(_death_line(-code, before_context))
    return DIED, child.pid


def _forward_interrupts(child) -> list[int]:
    """Hands the first interrupt on to the child; a second one, or its patience running out, kills it.

    Killing is safe: results take their names only when all are written. Returns the list that collects the interrupts.
    """
    received = []

    def forward(number, _frame):
        received.append(number)
        if len(received) == 1:
            child.send_signal(signal.SIGINT)
            patience = threading.Timer(PATIENCE_SECONDS, child.kill)
            patience.daemon = True
            patience.start()
        else:
            child.kill()

    for number in INTERRUPTS:
        signal.signal(number, forward)
    return received


def _death_line(number: int, before_context: bool) -> str:
    name = signal.Signals(number).name
    if number == signal.SIGKILL:
        return "the baking process was killed, most likely for lack of memory; use a lower --memory or --resolution"
    if before_context:
        drivers = system_libraries.install_command(["libegl1", "libegl-mesa0", "libgl1", "libgl1-mesa-dri"])
        return (
            f"no usable GPU context: Blender ended with {name} while it made one (--verbose shows its words); "
            f"install a GPU driver or Mesa's software driver: {drivers}"
        )
    return f"Blender ended with {name} in its GPU driver or its own code; the lines above (or --verbose) say where"
