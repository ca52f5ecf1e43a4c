"""Planes on both sides of a crease, the dihedral angle between them, fitted points, and lines smoothed along themselves.
In: the mesh, its refined normals and the chains found by detect.py. Out: angles and points per vertex (fit), and the chains as smooth
polylines (smooth). All lengths in here are in units of h, relative to the vertex. Plain numpy, one vertex at a time."""
import numpy as np

DEFAULT = dict(
    near=2.5, far=5.5, noisy=20.0,       # radius of the patch: from near without noise to far from so many rounds on
    width=0.5,                # faces belong to a plane whose normal is within this chord (29 degrees)
    gamma=5.0, ramp=0.5,      # side coordinate: distance across + gamma times what the normal says; weight rises over ramp
    split=4, rounds=3,        # rounds of telling the sides apart, rounds of fitting planes
    pull=0.3,                 # a plane's slopes are pulled to the refined normals as if the patch were this much wider
    floor=0.02,               # no plane is surer than this
    slack=0.5,                # how far a line vertex lies from the line; twice that with much noise
    shift=1.0,                # the crease is looked for within this distance of the vertex
    more=3, share=0.1,        # further planes (corners), each at least this share of the faces nearby
    close=1.0,                # a further plane counts less the farther off it passes, not at all from here on; at corners twice that
    move=1.5,                 # no point is moved farther
    bend=200.0, least=0.25,   # stiffness of the lines, shortest edge that counts
)


def unit(x):
    l = np.sqrt((x * x).sum())
    return x / l if l > 0 else x


def quantities(m, N, v, r):
    """faces around the vertices within r of v: barycentres, normals, areas, weight of distance, whether near (around the one-ring),
    whether own (around v), neighbours over edges"""
    V, h = m.V, m.h
    seen = {v}; ball = [v]
    for u in ball:
        for w in m.vv[m.vvp[u]:m.vvp[u + 1]]:
            if w not in seen and ((V[w] - V[v]) ** 2).sum() <= (r * h) ** 2:
                seen.add(w); ball.append(w)
    around = lambda vs: {int(f) for u in vs for f in m.vf[m.vfp[u]:m.vfp[u + 1]]}
    ring = set(m.vv[m.vvp[v]:m.vvp[v + 1]]) & seen
    near = around([v, *ring]); own = around([v])
    ids = np.array(sorted(f for f in near | around(ball) if m.A[f] > 0), int)
    if not len(ids):
        return None
    P = (V[m.F[ids]] - V[v]) / h
    c = P.mean(1); d2 = (c * c).sum(1)
    q = 1 - d2 / (r * r)
    isown = np.array([f in own for f in ids]); isnear = np.array([f in near for f in ids])
    q = np.where(isown, np.maximum(q, 0.1), q)
    edges = {}
    for i, f in enumerate(ids):
        a, b, d = m.F[f]
        for x, y in ((a, b), (b, d), (d, a)):
            edges.setdefault((min(x, y), max(x, y)), []).append(i)
    nb = [[] for _ in ids]
    for es in edges.values():
        for i in es:
            nb[i] += [j for j in es if j != i]
    return dict(P=P, c=c, d2=d2, n=N[ids], A=m.A[ids] / (h * h), D=np.where(q > 0, q * q, 0.0), own=isown, near=isnear, nb=nb)


def flood(k, w):
    """the faces of positive weight that are connected over edges to those around v, or else to those around its one-ring"""
    for seeds in (k['own'], k['near']):
        todo = [i for i in np.flatnonzero(seeds) if w[i] > 0]
        if todo:
            break
    got = set(todo)
    for i in todo:
        for j in k['nb'][i]:
            if w[j] > 0 and j not in got:
                got.add(j); todo.append(j)
    return np.array(sorted(got), int)


def agree(n, m, width):
    return np.maximum(1 - ((n - m) ** 2).sum(-1) / width ** 2, 0) ** 2


def plane(k, on, w, n, p):
    """z = a + b x + c y by least squares over the corners of the faces, in a frame around n: normal, offset, variance of the offset at v"""
    e = np.zeros(3); e[np.argmin(np.abs(n))] = 1
    ux = unit(np.cross(n, e)); uy = np.cross(n, ux)
    Q = k['P'][on].reshape(-1, 3); W = np.repeat(w[on] / 3, 3)
    B = np.c_[np.ones(len(Q)), Q @ ux, Q @ uy]; z = Q @ n
    M = B.T @ (W[:, None] * B) + w[on].sum() * p['pull'] ** 2 * np.diag([0, 1, 1]); R = B.T @ (W * z)
    s = np.linalg.solve(M, R)
    total = w[on].sum()
    spread = max((W * z * z).sum() - s @ R, 0) / total
    count = 0.5 * total ** 2 / (w[on] ** 2).sum() + 1
    lever = np.linalg.inv(M)[0, 0] * total
    nn = n - s[1] * ux - s[2] * uy; l = np.sqrt((nn * nn).sum())
    return nn / l, s[0] / l, spread * lever / count + p['floor'] ** 2


def sides(k, b, t, slack, p):
    """the planes on the +b and the -b side, or None"""
    x = k['c'] @ b; width = p['width']
    n = np.zeros((2, 3)); w = np.where(k['near'], k['A'] / (1 + k['d2']), 0)
    for _ in range(p['split']):
        s = np.clip((x + p['gamma'] * k['n'] @ (n[0] - n[1])) / p['ramp'], -1, 1)
        n = np.array([((w * np.maximum(g * s, 0))[:, None] * k['n']).sum(0) for g in (1, -1)])
        if not (n ** 2).sum(1).all():
            return None
        n = np.array([unit(n[0]), unit(n[1])])
    shift = 0.0
    for i in range(1 + p['rounds']):
        found = []
        for g, m in ((1, n[0]), (-1, n[1])):
            s = np.clip(g * (x - shift + p['gamma'] * k['n'] @ (n[0] - n[1])) / p['ramp'], 0, 1)
            W = k['A'] * k['D'] * agree(k['n'], m, width) * s
            on = flood(k, W)
            if not len(on):
                return None
            found.append((unit((W[on, None] * k['n'][on]).sum(0)), 0, 1) if i == 0 else plane(k, on, W, m, p))
        n = np.array([found[0][0], found[1][0]])
        if i:
            shift = np.clip(point(found, slack) @ b, -p['shift'], p['shift'])
    return found


def more_planes(k, have, close, p):
    """planes of faces near v that belong to none of the planes so far: (all of them, those that count, with their variances)"""
    width = p['width']
    w = np.where(k['near'], k['A'] / (1 + k['d2']), 0); normals = list(have); count = []
    for _ in range(p['more']):
        free = k['near'].copy()
        for m in normals:
            free &= agree(k['n'], m, width) == 0
        idx = np.flatnonzero(free)
        sums = [(w * agree(k['n'], k['n'][i], width)).sum() for i in idx]
        if not len(idx) or max(sums) < p['share'] * w.sum():
            break
        m = k['n'][idx[int(np.argmax(sums))]]
        for i in range(3):
            W = k['A'] * k['D'] * agree(k['n'], m, width)
            on = flood(k, W)
            if not len(on):
                break
            if i < 2:
                m = unit((W[on, None] * k['n'][on]).sum(0))
        if not len(on):
            normals.append(m)
            continue
        n, o, var = plane(k, on, W, m, p)
        normals.append(n)
        c = 1 - (o / close) ** 2
        if c > 0:
            count.append((n, o, var / (c * c)))
    return normals, count


def quadric(planes):
    A = np.zeros((3, 3)); g = np.zeros(3)
    for n, o, var in planes:
        A += np.outer(n, n) / var; g += n * o / var
    return A, g


def point(planes, slack):
    A, g = quadric(planes)
    return np.linalg.solve(A + np.eye(3) / slack ** 2, g)


def fit(m, N, v, t, b, corner, noise, p=DEFAULT):
    """noise: K_v over p['noisy'], at most 1. Signed dihedral angle (positive: convex; NaN: none), matrix and vector of the quadric"""
    r = p['near'] + (p['far'] - p['near']) * noise
    k = quantities(m, N, v, r)
    if k is None:
        return np.nan, False, np.zeros((3, 3)), np.zeros(3)
    found = sides(k, b, t, slack(noise, p), p) or []
    normals, further = more_planes(k, [f[0] for f in found], p['close'] * (2 if corner else 1), p)
    if found:
        (n, _, _), (o, _, _) = found
        angle, signed = np.arctan2(np.cross(n, o) @ t, n @ o), True
    else:       # a corner: the largest angle between two of its planes
        all_ = [np.arctan2(np.sqrt((np.cross(x, y) ** 2).sum()), x @ y) for i, x in enumerate(normals) for y in normals[:i]]
        angle, signed = max(all_, default=np.nan), False
    return angle, signed, *quadric(found + further)


def slack(noise, p=DEFAULT):
    return p['slack'] * (1 + noise)


def smooth(X, A, g, s, fixed, closed, p=DEFAULT):
    """X (n, 3): vertices of a chain in units of h (a closed one without its last); A, g their quadrics, s their slacks. Least squares: the
    quadrics, the distance from the vertices over the slack, and the bending. Ends that are fixed stay at the minimum of their own quadric."""
    n = len(X)
    H = A + np.eye(3) / s[:, None, None] ** 2
    D0 = np.linalg.solve(H, g[..., None])[..., 0]
    D0 = np.array([limit(d, p) for d in D0])
    Q = X + D0
    if n < 3:
        return Q
    B = np.zeros((3 * n, 3 * n)); R = np.zeros(3 * n)
    for i in range(n):
        B[3 * i:3 * i + 3, 3 * i:3 * i + 3] = H[i]; R[3 * i:3 * i + 3] = g[i]
    length = lambda i, j: max(np.sqrt(((Q[i] - Q[j]) ** 2).sum()), p['least'])
    for i in range(n) if closed else range(1, n - 1):
        a, c = (i - 1) % n, (i + 1) % n
        la, lc = length(a, i), length(i, c)
        co = {a: 1 / la, i: -1 / la - 1 / lc, c: 1 / lc}
        w = 2 * p['bend'] / (la + lc)
        d = sum(co[x] * X[x] for x in co)
        for x in co:
            R[3 * x:3 * x + 3] -= w * co[x] * d
            for y in co:
                B[3 * x:3 * x + 3, 3 * y:3 * y + 3] += w * co[x] * co[y] * np.eye(3)
    free = np.repeat(~fixed, 3)
    D = D0.ravel().copy()
    if free.any():
        D[free] = np.linalg.solve(B[np.ix_(free, free)], R[free] - B[np.ix_(free, ~free)] @ D[~free])
    return X + np.array([limit(d, p) for d in D.reshape(-1, 3)])


def limit(d, p):
    l = np.sqrt((d * d).sum())
    return d * (p['move'] / l) if l > p['move'] else d
