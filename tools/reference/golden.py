"""Golden results of the reference.
In: nothing (shapes.py, noise .1, seed 3). Out, for each shape, in fixtures/golden or the directory given as argument:
NAME.ply             the input mesh, double x y z
NAME.attributes.ply  per vertex x y z l1 l2 l3 omega saliency (S divided by its maximum) class
NAME.fields.ply      per vertex, for diagnosis, theta chi thr S SC q (angles in radians) ridge corner Kv
NAME.lines.json      h, numbers of vertices and faces, the chains as lists of vertex ids, closed ones ending on their first, for each
                     vertex of a chain its fitted point, and for each its signed dihedral angle in degrees"""
import json
import sys
from pathlib import Path
import numpy as np
import ply
from detect import detect
from shapes import noisy, shape

SHAPES = ['bracket', 'fold10', 'cone']
NOISE, SEED = 0.1, 3


def attributes(V, r):
    """the columns of an attributes file, in order"""
    top = r['saliency'].max(initial=0.0)
    return dict(x=V[:, 0], y=V[:, 1], z=V[:, 2], l1=r['l1'], l2=r['l2'], l3=r['l3'], omega=r['omega'],
                saliency=r['saliency'] / top if top > 0 else r['saliency'], **{'class': r['class'].astype(np.uint8)})


def golden(name, out):
    V, F, _ = shape(name)
    V = noisy(V, F, NOISE, SEED)
    ply.write(out / f'{name}.ply', dict(vertex=dict(x=V[:, 0], y=V[:, 1], z=V[:, 2]), face=dict(vertex_indices=F.astype(np.int32))))
    V, F = ply.mesh(out / f'{name}.ply')
    r = detect(V, F)
    ply.write(out / f'{name}.attributes.ply', dict(vertex=attributes(V, r)))
    u1 = lambda x: x.astype(np.uint8)
    ply.write(out / f'{name}.fields.ply', dict(vertex=dict(
        theta=r['theta'], chi=r['chi'], thr=r['thr'], S=r['saliency'], SC=r['SC'], q=r['q'],
        ridge=u1(r['ridge']), corner=u1(r['corner']), Kv=u1(r['Kv']))))
    rows = ',\n  '.join(json.dumps([int(v) for v in c]) for c in r['chains'])
    each = lambda x: '[' + ', '.join(json.dumps(y) for y in x) + ']'
    points = ',\n  '.join(each([[round(float(x), 9) for x in q] for q in c]) for c in r['fitted'])
    angles = ',\n  '.join(json.dumps([round(float(np.degrees(r['angle'][v])), 6) for v in c]) for c in r['chains'])
    (out / f'{name}.lines.json').write_text(
        f'{{"vertices": {len(V)}, "faces": {len(F)}, "h": {r["mesh"].h!r},\n "chains": [\n  {rows}\n ],\n "fitted": [\n  {points}\n ],\n "angles": [\n  {angles}\n ]}}\n')
    print(f'{name}: {len(V)} vertices, {len(F)} faces, {len(r["chains"])} chains')


if __name__ == '__main__':
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2] / 'fixtures' / 'golden'
    out.mkdir(parents=True, exist_ok=True)
    for s in SHAPES:
        golden(s, out)
