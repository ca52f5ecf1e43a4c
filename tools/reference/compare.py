"""Compares what crease finds with the reference, vertex by vertex and line by line.
In: MESH.ply, a binary triangle mesh; and either the program (--crease), which is run on it, or what it wrote: ATTRIBUTES.ply, per
vertex of that mesh and in its order x y z l1 l2 l3 omega saliency class, and LINES.ply (--lines).
Out: for each number the largest difference and how many vertices differ by more than the tolerance; how many classes differ,
and the first ten of them with the quantities the class was decided by (a value on its threshold is a tie); the mesh edges that
only one of the two draws lines along. Exit 1 if anything differs."""
import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
import numpy as np
import ply
from detect import DEFAULT, DEG, detect
from golden import attributes

NAMES = ['face', 'weak', 'sharp', 'corner', 'boundary']


def line_edges(path):
    """the mesh edges of a lines file, as pairs of ascending vertex ids; edges of borders and non-manifold edges left out"""
    f = ply.read(path)
    v, e = f['vertex']['source'].astype(np.int64), f['edge']
    kind = f['line']['class'][e['line']] if 'line' in f else np.zeros(len(e))
    return {tuple(sorted((int(v[x]), int(v[y])))) for x, y, k in zip(e['vertex1'], e['vertex2'], kind) if k not in (4, 5)}


def compare_lines(r, path):
    """how many mesh edges only one of the two has in its lines"""
    want = {tuple(sorted(map(int, p))) for c in r['chains'] for p in zip(c[:-1], c[1:])}
    got = line_edges(path)
    print(f'lines     {len(want)} edges; only in the reference: {len(want - got)}, only in {path}: {len(got - want)}')
    return len(want ^ got)


def main():
    a = argparse.ArgumentParser(description='compare what crease finds with the reference')
    a.add_argument('mesh'); a.add_argument('attributes', nargs='?')
    a.add_argument('--lines', help='the lines that crease wrote')
    a.add_argument('--crease', help='the program: runs it instead of reading what it wrote')
    a.add_argument('--tolerance', type=float, default=1e-9)
    a = a.parse_args()
    if bool(a.attributes) == bool(a.crease):
        sys.exit('either ATTRIBUTES.ply or --crease PROGRAM')
    if not a.crease:
        return compare(a)
    with tempfile.TemporaryDirectory() as place:
        a.attributes, a.lines = str(Path(place, 'attributes.ply')), str(Path(place, 'lines.ply'))
        subprocess.run([a.crease, 'detect', a.mesh, '--quiet', '-o', a.lines, '--attributes', a.attributes], check=True)
        return compare(a)


def compare(a):
    V, F = ply.mesh(a.mesh)
    got = ply.read(a.attributes)['vertex']
    if len(got) != len(V):
        sys.exit(f'{a.attributes}: {len(got)} vertices, the mesh has {len(V)}')
    r = detect(V, F)
    want = attributes(V, r)
    bad = 0
    print(f'{len(V)} vertices, {len(F)} faces, h = {r["mesh"].h:.6g}, tolerance {a.tolerance:g}')
    for c in ('x', 'y', 'z', 'l1', 'l2', 'l3', 'omega', 'saliency'):
        if c not in got.dtype.names:
            print(f'{c:9} missing'); bad += 1
            continue
        d = np.abs(got[c].astype(np.float64) - want[c])
        d[np.isnan(d)] = np.inf
        n = int((d > a.tolerance).sum()); bad += n
        if n or c not in 'xyz':
            i = int(d.argmax()) if len(d) else 0
            print(f'{c:9} max difference {d.max(initial=0):.3g}, above tolerance: {n}' + (f', largest at vertex {i}' if n else ''))
    k, w = got['class'].astype(np.int64), want['class'].astype(np.int64)
    diff = np.flatnonzero(k != w); bad += len(diff)
    print(f'class     different: {len(diff)}')
    if len(diff):
        print(f'  ties are q = 1, SC/S = {DEFAULT["rho"]}, S = {DEFAULT["sure"]}, theta = {DEFAULT["sharp"]}, phi = {DEFAULT["corner"]}')
    name = lambda c: NAMES[c] if c < len(NAMES) else str(c)
    for v in diff[:10]:
        S = r['saliency'][v]
        print(f'  vertex {v}: {name(k[v])}, reference {name(w[v])}; theta {r["theta"][v] / DEG:.9g} deg, q {r["q"][v]:.12g}, '
              f'SC/S {r["SC"][v] / S if S > 0 else 0:.12g}, S {S / DEG:.9g} deg, phi {r["phi"][v] / DEG:.9g} deg')
    if a.lines:
        bad += compare_lines(r, a.lines)
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
