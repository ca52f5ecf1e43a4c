"""Measures crease and what libraries offer for the same question, alternately, on the same files.

In: sizes of cities, meshes. Out: tables in markdown, and all numbers as JSON. Each run is written down when it is over, so
that a benchmark that was stopped goes on where it stopped. What is compared, and what not, is in docs/BENCHMARKS.md.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import measure
import programs
import table

HERE = Path(__file__).resolve().parent


def arguments():
    parser = argparse.ArgumentParser(prog="tools/bench/peers/run", description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--directory", type=Path, required=True, help="for meshes, results and temporary files")
    parser.add_argument("--sizes", nargs="*", default=["1e6", "1e7"], help="triangles of the cities (%(default)s)")
    parser.add_argument("--noises", nargs="*", default=["0", "0.03", "0.2"], help="in mean edges (%(default)s)")
    parser.add_argument("--meshes", nargs="*", type=Path, default=None, metavar="FILE",
                        help="further PLY files; ahn3_delft_tin.ply in $CREASE_DATA/meshes if there is one")
    parser.add_argument("--peers", nargs="*", default=list(programs.PEERS), choices=programs.PEERS, metavar="NAME",
                        help=f"of {', '.join(programs.PEERS)}; all")
    parser.add_argument("--threads", nargs="*", type=int, default=[1, 2], help="of crease (%(default)s)")
    parser.add_argument("--repeats", type=int, default=3, help="rounds in which each runs once (%(default)s)")
    parser.add_argument("--angle", type=float, default=30.0, help="threshold of the peers in degrees (%(default)s)")
    parser.add_argument("--estimate", action="store_true", help="only say what there is to do and how long it takes")
    parser.add_argument("--fresh", action="store_true", help="forget earlier runs")
    parser.add_argument("--markdown", type=Path, help="where to write the tables (DIRECTORY/peers.md)")
    parser.add_argument("--json", type=Path, help="where to write all numbers (DIRECTORY/peers.json)")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=[], help="further options of crease, last")
    # Told by the script that starts this one.
    for built in ("--crease", "--gen", "--cgal"):
        parser.add_argument(built, type=Path, help=argparse.SUPPRESS)
    return parser.parse_args()


def main():
    asked = arguments()
    asked.directory.mkdir(parents=True, exist_ok=True)
    meshes = meshes_of(asked)
    competitors = competitors_of(asked)
    log = Log(asked.directory / f"runs-{identity(asked)}.jsonl", asked.fresh)
    plan = [
        (repeat, mesh, competitor)
        for mesh in meshes
        for repeat in range(asked.repeats)
        # Each goes first in its turn.
        for competitor in turned(competitors, repeat)
        if not log.has(mesh.name, competitor.name, repeat)
    ]
    say_plan(plan, log)
    if not asked.estimate:
        warm = None
        for repeat, mesh, competitor in plan:
            if mesh != warm:
                mesh.make(asked.gen)
                mesh.warm()
                warm = mesh
            log.add(one_run(asked, mesh, competitor, repeat, log))
    finish(asked, competitors, meshes, log)


class Mesh:
    """A file, or a city that becomes one."""

    def __init__(self, path, size=None, noise=None):
        self.path, self.name, self.size, self.noise = path, path.stem, size, noise

    @property
    def faces(self):
        """As the header says; as asked for, as long as there is no file."""
        if not self.path.exists():
            return float(self.size)
        with self.path.open("rb") as file:
            for line in file:
                words = line.split()
                if words[:2] == [b"element", b"face"]:
                    return int(words[2])
                if words == [b"end_header"]:
                    break
        raise ValueError(f"{self.path} has no faces")

    def make(self, gen):
        if self.path.exists():
            return
        print(f"{self.name}: generating", file=sys.stderr)
        part = self.path.with_suffix(".part")
        command = [gen, "city", self.size, "--noise", self.noise, "-o", part]
        subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
        part.rename(self.path)

    def warm(self):
        """All programs find the mesh in the page cache, if it fits."""
        with self.path.open("rb") as file:
            while file.read(1 << 24):
                pass


def meshes_of(asked):
    meshes = [
        Mesh(asked.directory / f"city-{size}-{noise}.ply", size, noise)
        for size in sorted(asked.sizes, key=float)
        for noise in asked.noises
    ]
    further = asked.meshes
    if further is None:
        scan = Path(os.environ.get("CREASE_DATA", "")) / "meshes" / "ahn3_delft_tin.ply"
        further = [scan] if scan.exists() else []
    return meshes + [Mesh(path) for path in further]


def competitors_of(asked):
    crease = [programs.Crease(asked.crease, n, asked.directory / "temporary", asked.options) for n in asked.threads]
    peers = []
    for name in asked.peers:
        if name == "cgal" and not asked.cgal:
            print("cgal is left out: its headers (libcgal-dev) or a C++ compiler are missing", file=sys.stderr)
        else:
            peers.append(programs.Peer(name, asked.cgal if name == "cgal" else None))
    return crease + peers


def identity(asked):
    """Of what is measured and how: runs of another program do not go into the same table."""
    digest = hashlib.sha256(json.dumps([asked.angle, asked.options]).encode())
    for path in [asked.crease, *sorted(HERE.glob("*.py")), HERE / "cgal.cpp", HERE / "requirements.txt"]:
        # How results are shown does not change them.
        if path.name != "table.py":
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


class Log:
    """All runs that are over, one object on a line."""

    def __init__(self, path, fresh):
        self.path = path
        if fresh:
            path.unlink(missing_ok=True)
        # A line without an end is of a run whose writing was interrupted.
        lines = path.read_text().split("\n")[:-1] if path.exists() else []
        path.write_text("".join(f"{line}\n" for line in lines))
        self.runs = [json.loads(line) for line in lines]

    def has(self, mesh, program, repeat):
        return any((r["mesh"], r["program"], r["repeat"]) == (mesh, program, repeat) for r in self.runs)

    def of(self, program):
        return [run for run in self.runs if run["program"] == program and run["outcome"] == "done"]

    def add(self, run):
        self.runs.append(run)
        with self.path.open("a") as file:
            file.write(json.dumps(run) + "\n")


def turned(items, by):
    by %= len(items)
    return items[by:] + items[:by]


def say_plan(plan, log):
    total = 0.0
    for _, mesh, competitor in plan:
        known = [run["wall"] / run["faces"] for run in log.of(competitor.name)]
        total += mesh.faces * (sum(known) / len(known) if known else competitor.usual / 1e6)
    print(f"{len(plan)} runs, about {total / 60:.0f} min; {len(log.runs)} are done", file=sys.stderr)


def one_run(asked, mesh, competitor, repeat, log):
    run = {"mesh": mesh.name, "program": competitor.name, "repeat": repeat, "faces": mesh.faces}
    # Predicted by the smaller meshes; crease takes what it is given.
    needs = max((r["resident"] / r["faces"] for r in log.of(competitor.name)), default=0.0) * mesh.faces
    if isinstance(competitor, programs.Peer) and needs > measure.available_memory():
        return run | {"outcome": f"left out: needs some {needs / 2**30:.0f} GiB"}
    competitor.prepare()
    environment = dict(os.environ, TMPDIR=str(asked.directory))
    # Libraries would not find the compiled code that they were installed with.
    environment.pop("PYTHONPYCACHEPREFIX", None)
    measured = measure.run(competitor.command(mesh.path, asked.angle), environment)
    output, complaint = measured.pop("output"), measured.pop("complaint")
    if measured["code"] == 0:
        run |= measured | competitor.read(output) | {"outcome": "done"}
    else:
        code, last = measured["code"], (complaint.strip().splitlines() or ["nothing was said"])[-1]
        last = last.replace(str(mesh.path), mesh.path.name)
        how = f"exit code {code}: {last}" if code > 0 else f"killed by signal {-code}"
        run |= measured | {"outcome": how}
    print(f"{mesh.name} | {competitor.name} | round {repeat + 1} | {run['wall']:.2f} s wall, {run['cpu']:.2f} s CPU, "
          f"{run['others']:.1f} others | {run.get('found', '')} | {run['outcome']}", file=sys.stderr)
    return run


def finish(asked, competitors, meshes, log):
    names = {mesh.name for mesh in meshes}
    runs = [run for run in log.runs if run["mesh"] in names]
    if not runs:
        return
    about = [{"name": c.name, "command": c.shown(), "version": c.version()} for c in competitors]
    all_of_it = {"machine": measure.machine(), "angle": asked.angle, "programs": about, "runs": runs}
    (asked.json or asked.directory / "peers.json").write_text(json.dumps(all_of_it, indent=1) + "\n")
    text = table.markdown(all_of_it)
    (asked.markdown or asked.directory / "peers.md").write_text(text)
    print(text, end="")


if __name__ == "__main__":
    main()
