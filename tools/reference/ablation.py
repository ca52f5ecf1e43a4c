"""What each constant and each idea of the method is worth: switches it off, or moves it by 30 %, and scores the lines.
In: a directory that `quality run --keep DIR` has filled: generated meshes and real pairs, each with its true lines. Out: off.jsonl and moved.jsonl,
F1, precision and recall of every variant, a line for each mesh; and from these the tables of docs/QUALITY.md.
Lines are those of steps B to E along mesh edges. What a variant does not change is computed once for each mesh."""
import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
import numpy as np
import ply
from detect import DEFAULT, Mesh, find, refine
from metric import score

NEVER, HARDLY = 1e9, 1e-6

# what is switched off: (step, what it says in the table, parameters)
OFF = [
    ('A', 'no refinement of normals, so K = 0 everywhere', dict(slope=0.0)),
    ('A', 'as many rounds (40) wherever there is any noise', dict(slope=NEVER)),
    ('A', 'round 0 no wider than the others', dict(first=1.0)),
    ('A', 'no narrow early rounds', dict(early=0)),
    ('A', 'no widest kernel in late rounds', dict(w_max=NEVER)),
    ('A', 'no narrowest kernel', dict(c0=HARDLY)),
    ('B', 'no repeated votes: one scale', dict(revote=0)),
    ('B', 'no third scale', dict(wide=0.0)),
    ('B', 'threshold not raised with the third scale', dict(wide_bg=0.0)),
    ('B', 'nothing is calm', dict(calm=0.0)),
    ('B', 'everything is calm', dict(calm=NEVER)),
    ('B', 'no smallest threshold', dict(t_min=HARDLY)),
    ('B', 'no largest threshold', dict(t_max=NEVER)),
    ('B', 'contrast walks do not grow with K', dict(hops_k=0.0, reach_k=0.0)),
    ('B', 'contrast walks of any length', dict(reach=NEVER)),
    ('B', 'no ratio in the test for corners', dict(c_rat=0.0)),
    ('C', 'walks see the positions of the file', dict(relax=0.0)),
    ('C', 'smoothing reaches any neighbour', dict(relax_reach=NEVER)),
    ('C', 'no support along the line: S = theta', dict(steps=0)),
    ('C', 'supporters count in full', dict(lend=NEVER)),
    ('C', 'no contrast asked for', dict(rho=0.0, rho_hi=0.0)),
    ('C', 'no fold is sure without contrast', dict(sure=NEVER)),
    ('D', 'R is not averaged', dict(along=0, along_calm=0)),
    ('D', 'no more averaging where it is calm', dict(along_calm=DEFAULT['along'])),
    ('D', 'as much averaging everywhere', dict(along=DEFAULT['along_calm'])),
    ('D', 'a ridge need not fold itself', dict(own=0.0)),
    ('D', 'that test does not fade with K', dict(own_k=NEVER)),
    ('D', 'thinning within the one-ring only', dict(nms_r=0.0)),
    ('D', 'links of one edge', dict(lsteps=1)),
    ('D', 'links over features only', dict(q_link=1.0, c_link=1.0)),
    ('D', 'links need no contrast on the way', dict(c_link=0.0)),
    ('D', 'weight of a path without its direction', dict(across=1.0)),
    ('E', 'loops of any length', dict(loop=0.0, loop_k=0.0)),
    ('E', 'shortest loop does not grow with K', dict(loop_k=0.0)),
    ('E', 'no pruning of branches', dict(prune=0.0)),
    ('E', 'no shortest component', dict(iso=0.0)),
    ('E', 'no share of strong vertices asked for', dict(strong_frac=0.0)),
    ('E', 'strong needs no more contrast than a feature', dict(rho_hi=DEFAULT['rho'])),
    ('E', 'strong needs no larger measure than a feature', dict(q_hi=1.0)),
]
# what is moved by 30 % either way, whole numbers by at least 1: name here, name in src/config/method.rs
MOVED = dict(
    rounds='REFINE_ROUNDS', slope='REFINE_SLOPE', kappa='RANGE_KAPPA', first='2 (of round 0)', c0='RANGE_MIN_DEG', early='RANGE_EARLY_ROUNDS',
    w_early='RANGE_EARLY_DEG', w_max='RANGE_MAX_DEG', cell='LEVEL_CUBE', s_quant='NOISE_QUANTILE', b_quant='BACKGROUND_QUANTILE', revote='REVOTES',
    calm='CALM_DEG', wide='FURTHER_PER_ROUND', wide_bg='FURTHER_BACKGROUND', t_min='THRESHOLD_MIN_DEG', t_max='THRESHOLD_MAX_DEG',
    k_bg='THRESHOLD_BACKGROUND', low='TRACE_LOW', hops='CONTRAST_STEPS', reach='CONTRAST_REACH', hops_k='CONTRAST_STEPS_PER_ROUND',
    reach_k='CONTRAST_REACH_PER_ROUND', rho='CREST_CONTRAST', rho_hi='STRONG_CONTRAST', sure='SURE_DEG', steps='TRACE_STEPS',
    cone='CONE_COS (60 deg)', turn='TURN_COS (45 deg)', lend='TRACE_LEND', relax='SMOOTH_PER_ROUND', relax_max='SMOOTH_ROUNDS',
    relax_reach='SMOOTH_REACH', along='AVERAGE_ROUNDS', along_calm='AVERAGE_ROUNDS_CALM', own='OWN_SHARE', own_k='OWN_ROUNDS', nms_r='THIN_RADIUS',
    side='THIN_SIDE', q_link='LINK_MEASURE', c_link='LINK_CONTRAST', lsteps='LINK_STEPS', across='0.2 (of the weight)', loop='LOOP_LENGTH',
    loop_k='LOOP_PER_ROUND', prune='PRUNE_LENGTH', iso='MIN_LENGTH', q_hi='STRONG_MEASURE', strong_frac='STRONG_SHARE', corner='CORNER_MIN_DEG',
    c_rat='CORNER_RATIO')
# what step A reads
REFINING = ('rounds', 'slope', 'kappa', 'first', 'c0', 'early', 'w_early', 'w_max', 'cell', 's_quant')


def moved(name, sign):
    x = DEFAULT[name]
    return x + sign * max(1, round(0.3 * x)) if isinstance(x, int) else x * (1 + 0.3 * sign)


def variants(which):
    """name: parameters; the first is the method as it is"""
    out = {'': {}}
    if which == 'off':
        out |= {name: p for _, name, p in OFF}
    else:
        out |= {f'{name} {"-+"[sign > 0]}': {name: moved(name, sign)} for name in MOVED for sign in (-1, 1)}
    return out


def cases(place):
    """(set, noise, mesh file, file of true lines) of what `quality run --keep` has written"""
    for truth in sorted(Path(place).glob('*.truth.ply')):
        stem = truth.name[:-len('.truth.ply')]
        set_ = stem.split('-')[0]
        noise = stem.rsplit('-', 1)[1] if set_ == 'pairs' else stem.rsplit('-', 2)[1]
        yield set_, noise, str(truth.with_name(stem + '.ply')), str(truth)


def lines(path):
    d = ply.read(path)
    P, e = ply.points(d['vertex']), d['edge']
    return [P[[a, b]] for a, b in zip(e['vertex1'].astype(np.int64), e['vertex2'].astype(np.int64))]


def one(case, which):
    """[F1, precision, recall] or, where nothing is to be found, [length of found lines in h] for each variant"""
    _, _, mesh, truth = case
    m, want, out, refined = Mesh(*ply.mesh(mesh)), lines(truth), {}, {}
    for name, changed in variants(which).items():
        p = {**DEFAULT, **changed}
        key = tuple(p[k] for k in REFINING)
        if key not in refined:
            refined = {**{k: v for k, v in refined.items() if len(refined) < 2}, key: refine(m, p)}      # the first is that of the method
        found = find(m, refined[key], p)['polylines']
        s = score(found, want, m.h, tols=(1.0,))
        out[name] = [s['F1'], s['P1'], s['R1']] if want else [s['len'] / m.h]
    return case, out


def mean(found, name, wanted, which=0):
    """mean over the meshes with lines for which wanted holds: 0 F1, 1 precision, 2 recall"""
    x = [m['variants'][name][which] for m in found if len(m['variants'][name]) == 3 and wanted(m)]
    return sum(x) / len(x) if x else np.nan


def table(heads, rows):
    return '\n'.join('| ' + ' | '.join(r) + ' |' for r in [heads, ['---'] * len(heads), *rows])


def change(x, base):
    """in thousandths; a dash where nothing was measured"""
    if np.isnan(x - base):
        return '-'
    d = round(1000 * (x - base))
    return f'{d:+d}' if d else '0'


def tables(off, moved_):
    of = lambda set_, noise=None: lambda m: m['set'] == set_ and noise in (None, m['noise'])
    noises = sorted({m['noise'] for m in off if m['set'] == 'reference'})
    columns = [(n, of('reference', n), 0) for n in noises] + [('P', of('reference'), 1), ('R', of('reference'), 2)]
    columns += [('dense', of('dense'), 0), ('weak', of('weak'), 0), ('clean pairs', of('pairs', 'clean'), 0), ('noisy pairs', of('pairs', 'noisy'), 0)]
    smooth = lambda name: f"{sum(m['variants'][name][0] for m in off if len(m['variants'][name]) == 1):.0f}h"
    base = [mean(off, '', w, k) for _, w, k in columns]
    rows = [['', 'the method as it is', *(f'{x:.3f}' for x in base), smooth('')]]
    idle = []
    for step, name, _ in OFF:
        now = [mean(off, name, w, k) for _, w, k in columns]
        rows.append([step, name, *(change(x, b) for x, b in zip(now, base)), smooth(name)])
        if not any(x < b - 0.001 for (_, _, k), x, b in zip(columns, now, base) if k == 0) and smooth(name) == smooth(''):
            idle.append(name)
    text = [table(['step', 'switched off', *(c[0] for c in columns), 'smooth'], rows), '', 'Nothing lost by: ' + '; '.join(idle), '']
    rows, still = [], []
    for name, constant in MOVED.items():
        cells, largest = [], 0.0
        for sign in '-+':
            variant = f'{name} {sign}'
            d = [mean(moved_, variant, of('reference', n)) - mean(moved_, '', of('reference', n)) for n in noises]
            cells += [f'{moved(name, 1 if sign == "+" else -1):.4g}', *(change(x, 0) for x in d)]
            largest = max(largest, *np.abs(d))
        if largest >= 0.002:
            rows.append([constant, f'{DEFAULT[name]:g}', *cells])
        else:
            still.append(constant)
    text += [table(['constant', 'value', 'less', *noises, 'more', *noises], rows), '', 'Less than .002 is changed by: ' + ', '.join(still)]
    return '\n'.join(text)


def main():
    a = argparse.ArgumentParser(description='what each constant and each idea of the method is worth')
    a.add_argument('what', choices=['off', 'moved', 'tables'], help='switch ideas off, move constants, or print the tables of both')
    a.add_argument('results', type=Path, help='directory of off.jsonl and moved.jsonl')
    a.add_argument('--meshes', type=Path, help='directory that `quality run --keep` has filled')
    a.add_argument('--only', default='', help='meshes whose names begin so')
    a.add_argument('--jobs', type=int, default=1)
    a = a.parse_args()
    if a.what == 'tables':
        print(tables(*([json.loads(line) for line in open(a.results / f'{which}.jsonl')] for which in ('off', 'moved'))))
        return
    chosen = [c for c in cases(a.meshes) if Path(c[2]).name.startswith(a.only)]
    with ProcessPoolExecutor(a.jobs) as pool, open(a.results / f'{a.what}.jsonl', 'a') as out:
        for (set_, noise, mesh, _), found in pool.map(one, chosen, [a.what] * len(chosen)):
            print(json.dumps(dict(set=set_, noise=noise, mesh=Path(mesh).stem, variants=found)), file=out, flush=True)


if __name__ == '__main__':
    main()
