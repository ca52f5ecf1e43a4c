"""The programs beside each other: how each is called, and what its output says.

In: where they are. Out: for each a command for a mesh, and a reader of what it printed.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PYTHON_PEERS = ("vtk", "igl", "meshlib", "trimesh")
PEERS = ("cgal", *PYTHON_PEERS)

# Seconds of wall time for a million triangles, before anything was measured; for the estimate only.
USUAL = {"crease": 5.0, "cgal": 2.0, "vtk": 1.0, "igl": 1.5, "meshlib": 1.0, "trimesh": 2.0}


class Crease:
    """The program of this project, with a number of threads."""

    def __init__(self, binary, threads, scratch, options):
        self.binary, self.threads, self.scratch, self.options = binary, threads, scratch, options
        self.name = f"crease, {threads} thread{'s' if threads > 1 else ''}"
        self.usual = USUAL["crease"]

    def prepare(self):
        """Nothing of an earlier run may be there to go on from."""
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.scratch.mkdir(parents=True)

    def command(self, mesh, _degrees):
        lines = self.scratch / "lines.ply"
        fixed = ["detect", mesh, "-o", lines, "--workspace", self.scratch / "work", "--progress", "none"]
        return [self.binary, *fixed, "--threads", self.threads, *self.options]

    def shown(self):
        options = " ".join(self.options)
        return f"crease detect MESH -o LINES.ply --progress none --threads {self.threads} {options}".rstrip()

    def version(self):
        return output_of([self.binary, "--version"])

    def read(self, output):
        """Lines that were found, and wall and processor seconds of each stage."""
        lines = re.search(r"^found ([\d,]+) lines?\b", output, re.MULTILINE)
        found = f"{lines[1].replace(',', '')} lines" if lines else "no lines"
        return {"found": found, "stages": stages(output)}


class Peer:
    """A library, called by peer.py or by a program of its own."""

    def __init__(self, name, driver=None):
        self.name, self.driver, self.usual = name, driver, USUAL[name]

    def prepare(self):
        pass

    def command(self, mesh, degrees):
        if self.driver:
            return [self.driver, mesh, degrees]
        return [sys.executable, HERE / "peer.py", self.name, mesh, degrees]

    def shown(self):
        return "cgal MESH ANGLE (cgal.cpp)" if self.driver else f"python peer.py {self.name} MESH ANGLE"

    def version(self):
        return None

    def read(self, output):
        said = json.loads(output.strip().splitlines()[-1])
        parts = {name: said[name] for name in ("start", "read", "edges_found")}
        return {"found": f"{said['edges']} edges", "version": said["version"], "parts": parts}


def stages(output):
    """The table of stages in the summary: name, wall seconds, processor seconds."""
    found, inside = [], False
    for line in output.splitlines():
        cells = re.split(r"\s{2,}", line.strip())
        if cells[:3] == ["stage", "wall", "CPU"]:
            inside = True
        elif inside and len(cells) >= 3:
            found.append({"stage": cells[0], "wall": seconds(cells[1]), "cpu": seconds(cells[2])})
        else:
            inside = False
    if not found:
        raise ValueError("the summary of crease has no table of stages")
    return found


def seconds(text):
    """Of `1.25 s`, `3 min 07 s`, `1 h 05 min`."""
    units = {"s": 1.0, "min": 60.0, "h": 3600.0}
    words = text.split()
    return sum(float(n) * units[unit] for n, unit in zip(words[::2], words[1::2]))


def output_of(command):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True).stdout.strip()
