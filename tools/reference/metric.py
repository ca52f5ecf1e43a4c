"""How well found lines match true ones, by length.
In: lines and truth as lists of polylines, the unit of length h. Out: per tolerance (in h) precision P, recall R and F1, and the
lengths and the number of spurious lines."""
import numpy as np
from scipy.spatial import cKDTree


def sample(lines, step):
    """points on polylines and the length each stands for"""
    P, W = [], []
    for l in lines:
        l = np.asarray(l, float)
        for a, b in zip(l[:-1], l[1:]):
            d = np.linalg.norm(b - a)
            if d <= 0:
                continue
            n = max(1, int(np.ceil(d / step)))
            s = (np.arange(n) + 0.5) / n
            P.append(a + s[:, None] * (b - a)); W.append(np.full(n, d / n))
    if not P:
        return np.zeros((0, 3)), np.zeros(0)
    return np.vstack(P), np.concatenate(W)


def score(lines, gt, h, tols=(1.0, 2.0), ncomp=None):
    p, wp = sample(lines, 0.2 * h); g, wg = sample(gt, 0.2 * h)
    out = dict(len=wp.sum(), gt=wg.sum())
    dp = cKDTree(g).query(p)[0] if len(g) and len(p) else np.full(len(p), np.inf)
    dg = cKDTree(p).query(g)[0] if len(g) and len(p) else np.full(len(g), np.inf)
    for t in tols:
        P = (wp * (dp <= t * h)).sum() / wp.sum() if len(p) else (1.0 if not len(g) else 0.0)
        R = (wg * (dg <= t * h)).sum() / wg.sum() if len(g) else 1.0
        out['P%g' % t], out['R%g' % t] = P, R
        out['F%g' % t] = 2 * P * R / (P + R) if P + R > 0 else 0.0
    # spurious: chains with more than half of their length beyond 2h
    sp = 0
    for l in lines:
        a, w = sample([l], 0.2 * h)
        d = cKDTree(g).query(a)[0] if len(g) else np.full(len(a), np.inf)
        if (w * (d > 2 * h)).sum() > 0.5 * w.sum():
            sp += 1
    out['spur'] = sp
    return out
