"""Compares an attributes file written by crease with the reference, vertex by vertex.
In: MESH.ply, a binary triangle mesh, and ATTRIBUTES.ply, per vertex of that mesh and in its order x y z l1 l2 l3 omega saliency class.
Out: for each number the largest difference and how many vertices differ by more than the tolerance; how many classes differ,
and the first ten of them with the quantities the class was decided by (a value on its threshold is a tie). Exit 1 if anything differs."""
import argparse
import sys
import numpy as np
import ply
from detect import DEFAULT, DEG, detect
from golden import attributes

NAMES = ['face', 'weak', 'sharp', 'corner', 'boundary']


def main():
    a = argparse.ArgumentParser(description='compare an attributes file with the reference')
    a.add_argument('mesh'); a.add_argument('attributes')
    a.add_argument('--tolerance', type=float, default=1e-9)
    a = a.parse_args()
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
    return 1 if bad else 0


if __name__ == '__main__':
    sys.exit(main())
