"""Compares how crease and plyfile read every PLY file of a folder.

In: the program `read` of this folder, and a folder. Out: a markdown table. A file agrees if both read the same positions,
bit for bit, and the same triangles (polygons cut as fans), or if both find nothing that crease could work on. What else
there is must be explained in EXPLAINED, or the exit code is 1.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from plyfile import PlyData

# By name: why the two differ, and why it is right.
EXPLAINED = {
    "assimp__Wuson.ply": "the header has a line without the word `comment`; it hides no column, so it is read over",
    "assimp__cube_binary_header_with_RN_newline.ply": "LF and CR LF are mixed in the header",
    "trimesh__fuze_ascii.ply": "the program that wrote it adds colours to its faces that the header does not declare; they "
    "stand behind all that is declared",
}


class Nothing(Exception):
    """There is no mesh in the file."""


def theirs(path):
    """Positions and triangles by plyfile."""
    ply = PlyData.read(str(path))
    names = [element.name for element in ply.elements]
    if "vertex" not in names or "face" not in names or len(ply["face"].data) == 0:
        raise Nothing("no faces")
    vertex, face = ply["vertex"], ply["face"]
    positions = np.column_stack([np.asarray(vertex[axis], dtype=float) for axis in "xyz"])
    known = [prop.name for prop in face.properties]
    lists = face["vertex_indices" if "vertex_indices" in known else "vertex_index"]
    fans = [(c[0], c[i], c[i + 1]) for c in (list(map(int, row)) for row in lists) for i in range(1, len(c) - 1)]
    triangles = np.array(fans, dtype=np.int64).reshape(-1, 3)
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(positions)):
        raise Nothing("an index is out of range")
    return positions, triangles


def ours(read, path):
    """The same by crease."""
    done = subprocess.run([read, path], capture_output=True, check=False)
    if done.returncode == 3:
        raise Nothing(done.stderr.decode().strip().split(": ", 1)[-1])
    done.check_returncode()
    head, rest = done.stdout.split(b"\n", 1)
    vertices, triangles = map(int, head.split())
    split = 24 * vertices
    corners = np.frombuffer(rest[split:], dtype="<u8").astype(np.int64).reshape(triangles, 3)
    return np.frombuffer(rest[:split], dtype="<f8").reshape(vertices, 3), corners


def attempt(reader, refusals):
    """What the reader found, or the first line of why it did not. Other errors than `refusals` are bugs."""
    try:
        return reader(), None
    except Nothing as nothing:
        return None, str(nothing)
    except refusals as error:
        text = str(error).strip() or type(error).__name__
        return None, f"{type(error).__name__}: {text.splitlines()[0]}"


def counts(mesh, refusal):
    if mesh is None:
        return f"refused: {refusal}"
    counted = [(len(mesh[0]), "vertex", "vertices"), (len(mesh[1]), "triangle", "triangles")]
    return ", ".join(f"{count} {one if count == 1 else many}" for count, one, many in counted)


def verdict(a, b):
    if a is None or b is None:
        return "both refuse" if a is None and b is None else "differ"
    if a[0].shape != b[0].shape or not np.array_equal(a[1], b[1]):
        return "differ"
    if np.array_equal(a[0].view(np.int64), b[0].view(np.int64)):
        return "same"
    return f"same but for {np.abs(a[0] - b[0]).max():.1g}"


def cell(text, longest=110):
    text = text.replace("|", "\\|").replace("\n", " ")
    return text if len(text) <= longest else text[: longest - 3] + "..."


def main():
    read, folder = sys.argv[1], Path(sys.argv[2])
    unexplained = 0
    print("| file | crease | plyfile | |")
    print("|---|---|---|---|")
    for path in sorted(folder.iterdir()):
        if path.suffix == ".tsv":
            continue
        a, why_a = attempt(lambda: ours(read, path), Nothing)
        # plyfile lets errors of every kind through.
        b, why_b = attempt(lambda: theirs(path), Exception)
        found = verdict(a, b)
        if found not in ("same", "both refuse"):
            if EXPLAINED.get(path.name):
                found = f"{found}: {EXPLAINED[path.name]}"
            else:
                unexplained += 1
                found = f"{found}, unexplained"
        print(f"| `{path.name}` | {cell(counts(a, why_a))} | {cell(counts(b, why_b))} | {found} |")
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
