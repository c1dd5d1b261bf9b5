# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads mutations of one probe file and counts how each ended: mutate_probe_files.py FILE SEED COUNT

A process of its own, because a crash of OpenEXR's native code would end it: the last line of standard output names the
mutation that is being read, the line before the end is one JSON object. Whatever is read without an error must be the
light that was written: a wrong number that passes is worse than a crash.
"""

import importlib.util
import json
import random
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
INTERESTING = (b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\0\x80", b"\0\0\0\0", b"\x01\0\0\0", b"\0\0\x10\0")


def load_package() -> None:
    spec = importlib.util.spec_from_file_location("start", ROOT / "cli" / "__main__.py")
    start = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(start)
    start.load_package()


def mutated(data: bytes, header: int, rng: random.Random) -> bytearray:
    """One mutation of ``data``: cut, bits flipped, numbers replaced, pieces copied, removed or put in.

    Mostly in the first ``header`` bytes, where the sizes are.
    """
    result = bytearray(data)
    span = len(data) - 4 if rng.random() < 0.3 else header
    at = rng.randrange(span)
    kind = rng.randrange(7)
    if kind == 0:
        del result[rng.randrange(len(data)) :]
    elif kind == 1:
        for _ in range(rng.choice((1, 1, 1, 2, 8))):
            result[rng.randrange(span)] ^= 1 << rng.randrange(8)
    elif kind == 2:
        result[at : at + 4] = rng.choice(INTERESTING)
    elif kind == 3:
        start, length = rng.randrange(span), rng.randrange(1, 64)
        result[at : at + length] = data[start : start + length]
    elif kind == 4:
        del result[at : at + rng.randrange(1, 200)]
    elif kind == 5:
        result[at:at] = rng.randbytes(rng.randrange(1, 100))
    else:  # a digit of the JSON text, or of any other
        digits = [place for place in range(at, min(at + 2000, len(data))) if 48 <= data[place] <= 57]
        if digits:
            result[rng.choice(digits)] = rng.randrange(48, 58)
    return result


def main(path: Path, seed: int, count: int) -> dict:
    from gridlight.core.errors import InputError
    from gridlight.formats import probe_file

    data = path.read_bytes()
    original = probe_file.read(path)
    header = data.index(b"\0\0", data.index(b"screenWindowWidth"))
    rng = random.Random(seed)
    errors, slowest, unequal = 0, 0.0, 0
    with tempfile.TemporaryDirectory(prefix="gridlight-mutations-") as folder:
        victim = Path(folder) / "probes.exr"
        for number in range(count):
            change = mutated(data, header, rng)
            victim.write_bytes(change)
            if number % 100 == 0:
                print(f"reading mutation {number} of seed {seed}", flush=True)
            started = time.monotonic()
            try:
                field = probe_file.read(victim)
            except InputError as error:
                errors += 1
                assert str(victim) in str(error) and len(str(error).splitlines()) == 1, error
            else:
                unequal += not (
                    np.array_equal(field.coefficients, original.coefficients)
                    and np.array_equal(field.grid.matrix, original.grid.matrix)
                    and np.array_equal(field.depth, original.depth)
                )
            slowest = max(slowest, time.monotonic() - started)
    return {
        "errors": errors,
        "equal": count - errors - unequal,
        "unequal": unequal,
        "slowest_seconds": slowest,
        "most_memory_mib": _peak_mib(),
    }


def _peak_mib() -> int:
    """Most memory of this process. Not ``ru_maxrss``, which starts at what the parent had."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.split("VmHWM:")[1].split()[0]) >> 10


if __name__ == "__main__":
    load_package()
    print(json.dumps(main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
