# SPDX-License-Identifier: GPL-3.0-or-later
"""What a job will cost: seconds by number of workers, memory of a worker, how many shards serve. Standard library only.

A block of n active probes takes a + b·n seconds in each iteration, by measurement (farm/calibration.py). A worker does
its shards one after the other; the barrier waits for the slowest worker. Where a worker's surfaces do not all fit the
memory budget, iteration 1 begins each block with iteration 0 again.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

START_SECONDS = 4.0  # of a worker: Python, Dask, Blender, the GPU's context, shaders
TASK_SECONDS = 0.02  # of a task on its way: scheduler, pipes, hash and rename of its output
MERGE_SECONDS = 1e-5  # of a probe
BYTES_PER_TEXEL = 48  # of kept surfaces
PATCH_BYTES = 2000  # points, rays and light of a patch
PATCHES_PER_PROBE = 30  # of a block of 4096 in a furnished room
SHARDS_PER_WORKER = 4  # let a fast worker take over from a slow one


@dataclass(frozen=True)
class Line:
    """Seconds = ``fixed`` + ``each`` · n."""

    fixed: float
    each: float

    def __call__(self, count: float) -> float:
        return self.fixed + self.each * count

    @classmethod
    def through(cls, counts: list[int], seconds: list[float]) -> Line:
        """Through the first and last point, neither part negative; from nothing where there is but one."""
        if len(counts) < 2 or counts[-1] <= counts[0]:
            return cls(0.0, seconds[-1] / max(counts[-1], 1))
        each = max((seconds[-1] - seconds[0]) / (counts[-1] - counts[0]), 0.0)
        return cls(max(seconds[0] - each * counts[0], 0.0), each)


@dataclass(frozen=True)
class CostModel:
    """Of one device and scene: iterations 0 and 1 of a block, the scene's way to the GPU, memory of the process."""

    see: Line
    settle: Line
    scene_seconds: float
    process_bytes: float

    def seconds(self, plan: dict, workers: int) -> float:
        """From the start of ``workers`` to the probe files."""
        total = START_SECONDS + self.scene_seconds
        probes = 0
        for group, shards in _groups(plan).items():
            active = plan["frames"][group[0]]["volumes"][group[1]]["active"]
            used = min(workers, len(shards))
            counts = [[active[block] for block in shard] for shard in shards]
            fits = sum(map(sum, counts)) / used <= probes_in_budget(plan)
            first = [sum(map(self.see, blocks)) + TASK_SECONDS for blocks in counts]
            second = [
                sum(self.settle(n) + (0.0 if fits else self.see(n)) for n in blocks) + TASK_SECONDS for blocks in counts
            ]
            total += _longest(first, used) + TASK_SECONDS + _longest(second, used)
            probes += len(active) and sum(active)
        return total + MERGE_SECONDS * probes

    def worker_bytes(self, plan: dict) -> tuple[float, float]:
        """(main memory, GPU memory) that a worker needs at most."""
        largest = max(max(volume["active"]) for frame in plan["frames"] for volume in frame["volumes"])
        surfaces = min(largest, probes_in_budget(plan)) * probe_bytes(plan)
        budget = plan["settings"]["memory_mib"] << 20
        patches = largest * PATCHES_PER_PROBE * PATCH_BYTES
        return self.process_bytes + 2 * patches, max(surfaces, budget) * 1.25 + patches


def probe_bytes(plan: dict) -> int:
    """Of a probe's texel surfaces."""
    return 6 * plan["settings"]["face"] ** 2 * BYTES_PER_TEXEL


def probes_in_budget(plan: dict) -> int:
    return max(1, (plan["settings"]["memory_mib"] << 20) // probe_bytes(plan))


def table(model: CostModel, plan: dict) -> list[str]:
    """Lines for the user: time by number of workers, shards that serve, memory."""
    blocks = sum(len(blocks) for _, _, blocks in plan["shards"])
    lines = ["workers  expected time  shards that serve"]
    workers = 1
    while True:
        serve = min(blocks, SHARDS_PER_WORKER * workers)
        lines.append(f"{workers:7d}  {_time(model.seconds(plan, workers)):>13s}  {serve:17d}")
        if workers >= min(len(plan["shards"]), 1024):
            break
        workers *= 2
    main, device = model.worker_bytes(plan)
    lines.append(f"memory of a worker: about {main / 2**30:.1f} GiB, and {device / 2**30:.1f} GiB on its GPU")
    lines.append(f"shards: {len(plan['shards'])}, of {blocks} blocks in all; more workers than shards would idle")
    return lines


def totals(model: CostModel, plan: dict) -> dict:
    """The same for programs."""
    steps = {str(2**k): round(model.seconds(plan, 2**k), 3) for k in range(len(plan["shards"]).bit_length())}
    main, device = model.worker_bytes(plan)
    return {"model": asdict(model), "seconds": steps, "worker_bytes": int(main), "gpu_bytes": int(device)}


@dataclass(frozen=True)
class Network:
    """Of a farm whose workers share one storage."""

    bytes_per_second: float = 1.25e9  # 10 Gbit/s to the storage, all workers together
    tasks_per_second: float = 500.0  # that one scheduler hands out and takes back


def on_paper(
    model: CostModel, probes: int, block: int, workers: int, scene_bytes: float, objects: int, output_bytes: float = 964
) -> dict[str, float]:
    """Seconds of a bake too large to run here, part by part: ``probes`` in full blocks of ``block``, on ``workers``
    that read ``scene_bytes`` each, with votes on ``objects``, and ``output_bytes`` a probe."""
    network = Network()
    blocks = -(-probes // block)
    rounds = -(-blocks // workers)
    votes = 16.0 * objects
    return {
        "start": START_SECONDS,
        "scene": model.scene_seconds + workers * scene_bytes / network.bytes_per_second,
        "iteration 0": rounds * model.see(block),
        "barrier": blocks * votes / network.bytes_per_second + workers * votes / network.bytes_per_second,
        "iteration 1": rounds * (model.settle(block) + (model.see(block) if rounds > 1 else 0.0)),
        "scheduler": 2 * blocks / network.tasks_per_second,
        "outputs": 2 * probes * output_bytes / network.bytes_per_second,
        "merge": MERGE_SECONDS * probes,
    }


def _groups(plan: dict) -> dict[tuple[int, int], list[list[int]]]:
    result: dict[tuple[int, int], list[list[int]]] = {}
    for frame, volume, blocks in plan["shards"]:
        result.setdefault((frame, volume), []).append(blocks)
    return result


def _longest(seconds: list[float], workers: int) -> float:
    """When the last of ``workers`` is done, each free one taking the longest task that is left."""
    loads = [0.0] * workers
    for task in sorted(seconds, reverse=True):
        at = loads.index(min(loads))
        loads[at] += task
    return max(loads)


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 120 else f"{minutes / 60:.1f} h"
