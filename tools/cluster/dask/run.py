"""Runs a planned job on Dask distributed: workstations of an office, or one machine.

In: a workspace that `crease plan` has made, on a disk that all workers see under the same path, and the address of a scheduler.
Out: the outputs that were planned. Dask moves no data here: a task is the number of a tile, and its result is in the workspace.
If groups of tiles were planned, they are tasks too, when all tiles are done; one that fails is done without.
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

    def tile_words(tile):
        limits = ["--memory", str(memory[tile]), "--threads", str(options.threads)]
        return [options.crease, "tile", workspace, "--tile", str(tile), "--quiet", *limits]

    def group_words(group):
        return [options.crease, "stitch", workspace, "--group", str(group), "--quiet", "--threads", str(options.threads)]

    with Client(options.scheduler) as client:
        failed = run_all(client, plan["job"], "tile", longest_first(plan["tiles"]), tile_words, options.tries)
        if failed:
            return 6
        # The last step takes the tiles of a group that is not there.
        run_all(client, plan["job"], "group", longest_first(plan["groups"]), group_words, options.tries)
    return subprocess.run([options.crease, "stitch", workspace, "--progress", "none"], check=False).returncode


def longest_first(tasks):
    """Their numbers; so that the end is not waiting for one of the longest."""
    return [task["id"] for task in sorted(tasks, key=lambda task: -task["cpu_seconds"])]


def run_all(client, job, what, numbers, words, most):
    """Runs the tasks of a step to their end, each `most` times at most. Returns those that failed, and says why."""
    failed, tries = {}, dict.fromkeys(numbers, 1)

    def submit(number):
        key = f"{what}-{job}-{number}-{tries[number]}"
        return client.submit(crease, words(number), key=key, pure=False)

    tasks, running = {}, as_completed()
    for number in numbers:
        future = submit(number)
        tasks[future.key] = number
        running.add(future)
    for future in running if numbers else ():
        number = tasks.pop(future.key)
        if future.status == "finished":
            code, said = future.result()
        else:
            # Workers died under it too often.
            code, said = 130, f"{future.exception()!r}"
        if code == 0:
            continue
        if code in WORTH_ANOTHER_TRY and tries[number] < most:
            tries[number] += 1
            future = submit(number)
            tasks[future.key] = number
            running.add(future)
        else:
            failed[number] = (code, said)
    for number, (code, said) in sorted(failed.items()):
        print(f"{what} {number}: exit code {code}: {said.strip()}", file=sys.stderr)
    return failed


if __name__ == "__main__":
    sys.exit(main())
