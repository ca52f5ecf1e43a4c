"""How well found lines match true ones, by length.
In: lines and truth as lists of polylines, the unit of length h. Out: per tolerance (in h) precision P, recall R and F1, and the
lengths and the number of spurious lines."""
import numpy as np
from scipy.spatial import cKDTree


def sample(lines, step):
    """points in the middle of pieces of at most `step`, and the length each stands for"""
    lines = [np.asarray(l, float) for l in lines if len(l) > 1]
    if not lines:
        return np.zeros((0, 3)), np.zeros(0)
    a, b = np.vstack([l[:-1] for l in lines]), np.vstack([l[1:] for l in lines])
    d = np.linalg.norm(b - a, axis=1)
    a, b, d = a[d > 0], b[d > 0], d[d > 0]
    n = np.maximum(1, np.ceil(d / step)).astype(int)
    s = (np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n) + 0.5) / np.repeat(n, n)
    return np.repeat(a, n, axis=0) + s[:, None] * np.repeat(b - a, n, axis=0), np.repeat(d / n, n)


def score(lines, gt, h, tols=(1.0, 2.0)):
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
    n = [len(sample([l], 0.2 * h)[1]) for l in lines]
    of = np.repeat(np.arange(len(lines)), n)
    far = np.bincount(of, wp * (dp > 2 * h), len(lines))
    out['spur'] = int((far > 0.5 * np.bincount(of, wp, len(lines))).sum())
    return out
