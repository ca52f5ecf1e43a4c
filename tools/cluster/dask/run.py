"""Runs a planned job on Dask distributed: workstations of an office, or one machine.

In: a workspace that `crease plan` has made, on a disk that all workers see under the same path, and the address of a scheduler.
Out: the outputs that were planned. Dask moves no data here: a task is the number of a tile, and its result is in the workspace.
So a worker that dies costs the tiles that it was working on, and one that Dask starts again without need ends at once.

    dask scheduler                                          on one machine
    dask worker tcp://HOST:8786 --nthreads 1                on each machine, once for each task at a time
    python tools/cluster/dask/run.py /shared/work tcp://HOST:8786 --threads 8

Closed networks only, or TLS (docs/CLUSTER.md): whoever reaches a scheduler runs programs on its workers.
"""

import argparse
import json
import pathlib
import subprocess
import sys

from distributed import Client, as_completed

# What starting again can help: the disk was full or the memory short for a while (4), or somebody interrupted (130). Anything
# else says the same again.
WORTH_ANOTHER_TRY = {4, 130}


def crease(words):
    """Runs the program; returns its exit code and what it said. A signal that killed it counts as an interruption."""
    ended = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return (130 if ended.returncode < 0 else ended.returncode), ended.stdout


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("workspace", type=pathlib.Path)
    arguments.add_argument("scheduler", help="tcp://HOST:PORT, tls://HOST:PORT")
    arguments.add_argument("--crease", default="crease", help="the program, as the workers find it")
    arguments.add_argument("--threads", type=int, default=0, help="threads of a task; 0 is all that the machine has")
    arguments.add_argument("--tries", type=int, default=3, help="how often a tile is started at most")
    options = arguments.parse_args()
    workspace = str(options.workspace.resolve())
    plan = json.loads((options.workspace / "plan.json").read_text())
    memory = {tile["id"]: tile["memory_bytes"] for tile in plan["tiles"]}

    def words(tile):
        limits = ["--memory", str(memory[tile]), "--threads", str(options.threads)]
        return [options.crease, "tile", workspace, "--tile", str(tile), "--quiet", *limits]

    # The longest first, so that the end is not waiting for one of them.
    order = sorted(plan["tiles"], key=lambda tile: -tile["cpu_seconds"])
    failed, tries = {}, dict.fromkeys(memory, 1)
    with Client(options.scheduler) as client:

        def submit(tile):
            key = f"tile-{plan['job']}-{tile}-{tries[tile]}"
            return client.submit(crease, words(tile), key=key, pure=False)

        tasks = {}
        running = as_completed()
        for tile in order:
            future = submit(tile["id"])
            tasks[future.key] = tile["id"]
            running.add(future)
        for future in running:
            tile = tasks.pop(future.key)
            if future.status == "finished":
                code, said = future.result()
            else:
                # Workers died under it too often.
                code, said = 130, f"{future.exception()!r}"
            if code == 0:
                continue
            if code in WORTH_ANOTHER_TRY and tries[tile] < options.tries:
                tries[tile] += 1
                future = submit(tile)
                tasks[future.key] = tile
                running.add(future)
            else:
                failed[tile] = (code, said)
    for tile, (code, said) in sorted(failed.items()):
        print(f"tile {tile}: exit code {code}: {said.strip()}", file=sys.stderr)
    if failed:
        return 6
    return subprocess.run([options.crease, "stitch", workspace, "--progress", "none"], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
