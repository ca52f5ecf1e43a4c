"""Two-pass normal tensor voting feature-line detector: independent in-core reference (f64, deterministic).
Pass A refines the face normals (tokens vote among themselves), pass B votes the refined normals into vertex tensors.
In: vertices (n, 3), triangles (m, 3). Out: a dict of per-vertex results and every intermediate field, and the lines (see detect())."""
import numpy as np
from numba import njit
import fit

DEG = np.pi / 180
DEFAULT = dict(
    rounds=40, slope=80.0,    # local number of rounds K = min(rounds, round(slope * s0))
    kappa=4.0, first=2.0, c0=1.5,   # range width = kappa * local noise level (first times that in round 0), at least c0 deg and
    early=5, w_early=30.0, w_max=45.0,   # at most w_early deg in rounds 1 .. early, w_max deg later
    cell=6.0, s_quant=0.5, b_quant=0.3,   # local levels: cube edge in h, quantiles for noise and background
    revote=3,                 # pass B: further votes of the tensors over the one-ring
    calm=6.0, wide=0.3, wide_bg=0.045,   # where the threshold is below calm deg: floor(wide K) votes more, each raising it so much
    t_min=0.6, t_max=20.0, k_bg=2.0,      # threshold = clamp(k_bg * background, t_min deg, t_max deg)
    low=0.5,                  # trace candidates: theta >= low * threshold
    hops=3, reach=3.0, hops_k=0.2, reach_k=0.15,   # contrast walk across the line (vertices, h), more for each round K
    rho=0.4, rho_hi=0.45, sure=45.0,     # crest test: traced contrast >= rho * traced fold
    steps=5, cone=60.0, turn=45.0, lend=1.25,   # trace; a supporter counts at most lend times the vertex's own fold
    relax=0.1, relax_max=3, relax_reach=2.0,   # walks along lines see positions after min(relax_max, floor(relax K)) rounds of
                              # smoothing by the neighbours within relax_reach h
    along=8, along_calm=16,   # at most so many rounds of averaging along the line for the thinning score
    own=0.25, own_k=30.0,     # a ridge vertex folds itself: T0 shows own (1 - K/own_k) of what T3 shows
    nms_r=1.6, side=2.5,      # thinning radius in h; "across" = (e.b)^2 >= side (e.t)^2
    q_link=0.6, c_link=0.7, lsteps=3,   # linking: shares of threshold and crest contrast on the way, most steps
    across=0.2,               # share of the weight that an edge has which runs across the line
    loop=6.0, loop_k=0.1, prune=6.0, iso=8.0,        # graph, in h; loops below loop + loop_k K are not closed
    q_hi=1.3, strong_frac=0.25,           # hysteresis
    corner=20.0, c_rat=0.4, sharp=30.0,   # classes, deg
)


def csr(keys, vals, n):
    o = np.lexsort((vals, keys))
    p = np.zeros(n + 1, np.int64)
    np.add.at(p, keys + 1, 1)
    return np.cumsum(p), vals[o].astype(np.int64)


def median_side(V, F):
    """h: median length of the sides of all faces (a shared edge counts once per face), read off an integer histogram of the
    squared lengths with 64 bins per octave (the upper bits of the f64), lower bound of the bin that holds element (n-1)//2"""
    d = np.concatenate([V[F[:, a]] - V[F[:, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    k = (d * d).sum(1).view(np.int64) >> 46
    k = k[k > 0]
    return float(np.sqrt((np.sort(k)[(len(k) - 1) // 2] << 46).astype(np.int64).view(np.float64)))


class Mesh:
    def __init__(self, V, F):
        V = np.ascontiguousarray(V, np.float64); F = np.ascontiguousarray(F, np.int64)
        self.V, self.F = V, F
        n, m = len(V), len(F)
        x = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
        l = np.linalg.norm(x, axis=1)
        e = np.vstack([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
        fid = np.tile(np.arange(m), 3)
        es = np.sort(e, axis=1)
        uk, inv, cnt = np.unique(es[:, 0] * n + es[:, 1], return_inverse=True, return_counts=True)
        self.E = np.c_[uk // n, uk % n]
        self.h = median_side(V, F)
        self.lo = V[F.ravel()].min(axis=0)      # origin of the level grids
        deg = l <= 1e-10 * self.h * self.h
        self.N = x / np.where(deg, 1.0, l)[:, None]; self.N[deg] = 0
        self.A = np.where(deg, 0.0, l * 0.5)
        self.C = (V[F[:, 0]] + V[F[:, 1]] + V[F[:, 2]]) / 3.0
        self.vfp, self.vf = csr(F.ravel(), np.repeat(np.arange(m), 3), n)
        ee = np.vstack([self.E, self.E[:, ::-1]])
        self.vvp, self.vv = csr(ee[:, 0], ee[:, 1], n)
        self.two = cnt == 2
        o = np.argsort(inv, kind='stable'); fo = fid[o]; st = np.r_[0, np.cumsum(cnt)]
        self.ea, self.eb = fo[st[:-1][self.two]], fo[st[:-1][self.two] + 1]
        self.bedge = self.E[cnt == 1]
        self.nmedge = self.E[cnt > 2]


# ------------------------------------------------------------------ local levels on a fixed grid of cubes
def cell_level(P, x, cell, quant, lo):
    """quant-quantile of x over the 3x3x3 block of grid cubes (edge `cell`, anchored at the corner `lo` of the bounds) around each point.
    Exact integer histograms with 8 bins per octave (frexp), so the result does not depend on any order.
    Returns (function of points -> level)."""
    c = np.floor((P - lo) / cell).astype(np.int64)
    mant, ex = np.frexp(np.maximum(x, 2.0 ** -30))
    k = np.clip((ex + 30) * 8 + np.floor((mant - 0.5) * 16).astype(np.int64), 0, 8 * 40 - 1)
    key, inv = np.unique(c, axis=0, return_inverse=True)
    inv = np.asarray(inv).ravel()
    H = np.zeros((len(key), 8 * 40), np.int64)
    np.add.at(H, (inv, k), 1)
    idx = {tuple(q): i for i, q in enumerate(key.tolist())}
    off = [(i, j, l) for i in (-1, 0, 1) for j in (-1, 0, 1) for l in (-1, 0, 1)]
    lev = {}

    def at(Q):
        d = np.floor((Q - lo) / cell).astype(np.int64)
        kk, ii = np.unique(d, axis=0, return_inverse=True)
        r = np.zeros(len(kk))
        for n, q in enumerate(kk.tolist()):
            q = tuple(q)
            if q not in lev:
                S = np.zeros(8 * 40, np.int64)
                for o in off:
                    i = idx.get((q[0] + o[0], q[1] + o[1], q[2] + o[2]))
                    if i is not None:
                        S += H[i]
                t = S.sum()
                if t == 0:
                    lev[q] = 0.0
                else:
                    b = int(np.searchsorted(np.cumsum(S), int(quant * (t - 1)) + 1))
                    lev[q] = 0.0 if b == 8 else (0.5 + (b % 8 + 0.5) / 16) * 2.0 ** (b // 8 - 30)
            r[n] = lev[q]
        return r[np.asarray(ii).ravel()]
    return at


# ------------------------------------------------------------------ pass A
@njit(cache=True)
def round_vertex(F, N, A, vfp, vf, w2, go):
    """where go: n_f <- unit(sum_g A_g k_fg (1 - |n_f-n_g|^2/w2_f)_+^2 n_g), k_fg = number of shared vertices (self 3)"""
    m = F.shape[0]
    O = np.zeros((m, 3))
    for f in range(m):
        if not go[f]:
            O[f] = N[f]
            continue
        x = 0.0; y = 0.0; z = 0.0
        iw = 1.0 / w2[f]
        for c in range(3):
            v = F[f, c]
            for i in range(vfp[v], vfp[v + 1]):
                g = vf[i]
                dx = N[f, 0] - N[g, 0]; dy = N[f, 1] - N[g, 1]; dz = N[f, 2] - N[g, 2]
                t = 1.0 - (dx * dx + dy * dy + dz * dz) * iw
                if t > 0:
                    t = t * t * A[g]
                    x += t * N[g, 0]; y += t * N[g, 1]; z += t * N[g, 2]
        l = np.sqrt(x * x + y * y + z * z)
        if l > 0:
            O[f, 0] = x / l; O[f, 1] = y / l; O[f, 2] = z / l
        else:
            O[f, 0] = N[f, 0]; O[f, 1] = N[f, 1]; O[f, 2] = N[f, 2]
    return O


def refine(m, p):
    """s0 = local median of the chords |n_f-n_g| over the edges; range width first kappa s0 in round 0, then min(kappa s0, w_early or w_max), never below c0.
    A face takes part in the first K = min(rounds, round(slope s0)) rounds and then stands still. Returns the normals, s0, K at faces, K at vertices"""
    N = m.N
    x = np.linalg.norm(N[m.ea] - N[m.eb], axis=1)
    e = m.E[m.two]
    mid = 0.5 * (m.V[e[:, 0]] + m.V[e[:, 1]])
    level = cell_level(mid, x, p['cell'] * m.h, p['s_quant'], m.lo)
    count = lambda s: np.minimum(p['rounds'], np.floor(p['slope'] * s + 0.5)).astype(np.int64)
    s0 = level(m.C)
    K = count(s0)
    for k in range(int(K.max(initial=0))):
        w = p['first'] * p['kappa'] * s0 if k == 0 else np.minimum(p['kappa'] * s0, p['w_early' if k <= p['early'] else 'w_max'] * DEG)
        w = np.maximum(p['c0'] * DEG, w)
        N = round_vertex(m.F, N, m.A, m.vfp, m.vf, w * w, K > k)
    return N, s0, K, count(level(m.V))


# ------------------------------------------------------------------ pass B
@njit(cache=True)
def vote(V, C, N, A, vfp, vf, lam):
    n = V.shape[0]
    T = np.zeros((n, 3, 3)); NV = np.zeros((n, 3))
    for v in range(n):
        am = 0.0
        for k in range(vfp[v], vfp[v + 1]):
            am = max(am, A[vf[k]])
        if am <= 0:
            continue
        for k in range(vfp[v], vfp[v + 1]):
            f = vf[k]
            d = np.sqrt((C[f, 0] - V[v, 0]) ** 2 + (C[f, 1] - V[v, 1]) ** 2 + (C[f, 2] - V[v, 2]) ** 2)
            w = A[f] / am * np.exp(-d / lam)
            for i in range(3):
                NV[v, i] += w * N[f, i]
                for j in range(3):
                    T[v, i, j] += w * N[f, i] * N[f, j]
    return T, NV


@njit(cache=True)
def vote_twice(T, vvp, vv):
    n = T.shape[0]
    O = np.zeros_like(T)
    for v in range(n):
        for i in range(3):
            for j in range(3):
                O[v, i, j] = 2.0 * T[v, i, j]
        for k in range(vvp[v], vvp[v + 1]):
            u = vv[k]
            for i in range(3):
                for j in range(3):
                    O[v, i, j] += T[u, i, j]
    return O


def eig(T):
    w, U = np.linalg.eigh(T)
    L = np.maximum(w[:, ::-1], 0.0)
    return L / np.maximum(L[:, :1], 1e-300), U[:, :, ::-1]


@njit(cache=True)
def along(V, vvp, vv, t, x):
    """one round of averaging along the feature direction: weight cos^4(u-v, t_v) cos^2(t_u, t_v), self 1"""
    n = V.shape[0]; o = np.zeros(n)
    for v in range(n):
        a = x[v]; k = 1.0
        for i in range(vvp[v], vvp[v + 1]):
            u = vv[i]
            e0 = V[u, 0] - V[v, 0]; e1 = V[u, 1] - V[v, 1]; e2 = V[u, 2] - V[v, 2]
            l = e0 * e0 + e1 * e1 + e2 * e2
            if l <= 0:
                continue
            c = e0 * t[v, 0] + e1 * t[v, 1] + e2 * t[v, 2]
            g = t[v, 0] * t[u, 0] + t[v, 1] * t[u, 1] + t[v, 2] * t[u, 2]
            w = (c * c / l) * (c * c / l) * g * g
            a += w * x[u]; k += w
        o[v] = a / k
    return o


@njit(cache=True)
def contrast(V, vvp, vv, b, t, th, hops, ccone, reach):
    """chi = theta(v) - mean over the two sides of the smallest theta met on a walk along +-b (at most hops[v] vertices, within reach[v])"""
    n = V.shape[0]
    X = np.zeros(n)
    for v in range(n):
        tot = 0.0
        for side in range(2):
            s = 1.0 if side == 0 else -1.0
            d0 = s * b[v, 0]; d1 = s * b[v, 1]; d2 = s * b[v, 2]
            cur = v; mn = th[v]
            for st in range(hops[v]):
                best = -1; bc = ccone
                for k in range(vvp[cur], vvp[cur + 1]):
                    u = vv[k]
                    e0 = V[u, 0] - V[cur, 0]; e1 = V[u, 1] - V[cur, 1]; e2 = V[u, 2] - V[cur, 2]
                    l = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
                    if l <= 0:
                        continue
                    if st == 0:      # measured in the tangent plane, so that steep folds are left too
                        c = e0 * d0 + e1 * d1 + e2 * d2
                        a = e0 * t[v, 0] + e1 * t[v, 1] + e2 * t[v, 2]
                        l = np.sqrt(c * c + a * a)
                        c = c / l if l > 0 else 0.0
                    else:
                        c = (e0 * d0 + e1 * d1 + e2 * d2) / l
                    if c > bc:
                        bc = c; best = u
                if best < 0:
                    break
                e0 = V[best, 0] - V[v, 0]; e1 = V[best, 1] - V[v, 1]; e2 = V[best, 2] - V[v, 2]
                if e0 * e0 + e1 * e1 + e2 * e2 > reach[v] * reach[v]:
                    break
                if th[best] < mn:
                    mn = th[best]
                if st == 0:      # then straight on in space
                    r = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
                    d0 = 0.5 * d0 + 0.5 * e0 / r; d1 = 0.5 * d1 + 0.5 * e1 / r; d2 = 0.5 * d2 + 0.5 * e2 / r
                    r = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                    d0 /= r; d1 /= r; d2 /= r
                cur = best
            tot += mn
        X[v] = th[v] - 0.5 * tot
    return X


@njit(cache=True)
def trace(V, vvp, vv, t, th, chi, low, stop, steps, ccone, cturn, lend):
    """neighbour support: mean fold angle over at most `steps` vertices on each side along +-t (missing vertices count 0); none counts
    more than lend times the vertex's own"""
    n = V.shape[0]
    S = np.zeros(n); SC = np.zeros(n)
    for v in range(n):
        if th[v] < low[v]:
            continue
        tot = th[v]; cnt = 1.0; totc = chi[v]
        for side in range(2):
            s = 1.0 if side == 0 else -1.0
            d0 = s * t[v, 0]; d1 = s * t[v, 1]; d2 = s * t[v, 2]
            cur = v; prev = -1; full = True; got = 0; acc = 0.0; accc = 0.0
            while got < steps:
                best = -1; bs = 0.0
                for k in range(vvp[cur], vvp[cur + 1]):
                    u = vv[k]
                    if u == prev or u == v:
                        continue
                    e0 = V[u, 0] - V[cur, 0]; e1 = V[u, 1] - V[cur, 1]; e2 = V[u, 2] - V[cur, 2]
                    l = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
                    if l <= 0:
                        continue
                    c = (e0 * d0 + e1 * d1 + e2 * d2) / l
                    if c < ccone:
                        continue
                    if not stop[u]:
                        if th[u] < low[u]:
                            continue
                        a = t[u, 0] * d0 + t[u, 1] * d1 + t[u, 2] * d2
                        if abs(a) < cturn:
                            continue
                    sc = c * c * th[u]
                    if sc > bs:
                        bs = sc; best = u
                if best < 0:
                    full = False
                    break
                if stop[best]:
                    break
                w = min(th[best], lend * th[v])
                acc += w; accc += chi[best] * (w / th[best]); got += 1
                a = t[best, 0] * d0 + t[best, 1] * d1 + t[best, 2] * d2
                a = 1.0 if a >= 0 else -1.0
                d0 = d0 + a * t[best, 0]; d1 = d1 + a * t[best, 1]; d2 = d2 + a * t[best, 2]
                r = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                d0 /= r; d1 /= r; d2 /= r
                prev = cur; cur = best
            tot += acc; totc += accc
            cnt += got if full else steps
        S[v] = tot / cnt; SC[v] = totc / cnt
    return S, SC


@njit(cache=True)
def nms(V, vvp, vv, b, t, R, ok, rad, side):
    """v stays if no vertex within rad (one-ring always), seen across the line, has larger R (ties: lower id wins)"""
    n = V.shape[0]
    out = np.zeros(n, np.bool_); stamp = np.full(n, -1, np.int64); buf = np.zeros(n, np.int64)
    for v in range(n):
        if not ok[v]:
            continue
        m = 1; buf[0] = v; stamp[v] = v; i = 0; keep = True
        while i < m and keep:
            u = buf[i]; i += 1
            for k in range(vvp[u], vvp[u + 1]):
                w = vv[k]
                if stamp[w] == v:
                    continue
                stamp[w] = v
                dx = V[w, 0] - V[v, 0]; dy = V[w, 1] - V[v, 1]; dz = V[w, 2] - V[v, 2]
                d2 = dx * dx + dy * dy + dz * dz
                if d2 <= rad * rad:
                    buf[m] = w; m += 1
                elif u != v:
                    continue
                c = dx * b[v, 0] + dy * b[v, 1] + dz * b[v, 2]
                a = dx * t[v, 0] + dy * t[v, 1] + dz * t[v, 2]
                if c * c >= side * a * a and (R[w] > R[v] or (R[w] == R[v] and w < v)):
                    keep = False
                    break
        out[v] = keep
    return out


@njit(cache=True)
def link(V, vvp, vv, t, S, ridge, stop, ok, ccone, steps):
    """paths of at most `steps` edges from ridge vertices to ridge vertices or stops, as (a, b, index in the path)"""
    n = V.shape[0]
    out = []
    path = np.zeros(16, np.int64)
    for v in range(n):
        if not ridge[v]:
            continue
        for side in range(2):
            s = 1.0 if side == 0 else -1.0
            d0 = s * t[v, 0]; d1 = s * t[v, 1]; d2 = s * t[v, 2]
            cur = v; m = 0; hit = False
            for st in range(steps):
                best = -1; bs = 0.0; bk = -1
                for k in range(vvp[cur], vvp[cur + 1]):
                    u = vv[k]
                    if not (ok[u] or stop[u]):
                        continue
                    e0 = V[u, 0] - V[cur, 0]; e1 = V[u, 1] - V[cur, 1]; e2 = V[u, 2] - V[cur, 2]
                    l = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
                    if l <= 0:
                        continue
                    c = (e0 * d0 + e1 * d1 + e2 * d2) / l
                    if c < ccone:
                        continue
                    pr = 1 if (ridge[u] or stop[u]) else 0
                    sc = c * c * S[u]
                    if pr > bk or (pr == bk and sc > bs):
                        bk = pr; bs = sc; best = u
                if best < 0:
                    break
                path[m] = best; m += 1
                if ridge[best] or stop[best]:
                    hit = True
                    break
                k = t[best, 0] * d0 + t[best, 1] * d1 + t[best, 2] * d2
                k = 1.0 if k >= 0 else -1.0
                d0 = d0 + k * t[best, 0]; d1 = d1 + k * t[best, 1]; d2 = d2 + k * t[best, 2]
                r = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
                if r <= 0:
                    break
                d0 /= r; d1 /= r; d2 /= r
                cur = best
            if hit:
                a = v
                for i in range(m):
                    out.append((a, path[i], i)); a = path[i]      # i = 0 begins a path
    return out


# ------------------------------------------------------------------ sparse graph
class Graph:
    def __init__(self, V, edges):
        self.V = V; self.adj = {}
        for a, b in edges:
            self.add(a, b)

    def add(self, a, b):
        l = float(np.sqrt(((self.V[a] - self.V[b]) ** 2).sum()))
        self.adj.setdefault(a, {})[b] = l; self.adj.setdefault(b, {})[a] = l

    def rem(self, a, b):
        del self.adj[a][b]; del self.adj[b][a]
        if not self.adj[a]: del self.adj[a]
        if not self.adj[b]: del self.adj[b]


def near(adj, a, b, lim):
    import heapq
    best = {a: 0.0}; q = [(0.0, a)]
    while q:
        d, u = heapq.heappop(q)
        if u == b:
            return True
        if d > best[u]:
            continue
        for w, l in adj.get(u, {}).items():
            e = d + l
            if e <= lim and e < best.get(w, 1e300):
                best[w] = e; heapq.heappush(q, (e, w))
    return False


def thin_graph(V, paths, loop):
    """paths as units, in ascending order of their keys; a path is kept unless its ends are already within `loop` (the smaller of
    the values at its ends) of each other in the graph"""
    g = Graph(V, [])
    for key in sorted(paths):
        c = paths[key]
        if not near(g.adj, c[0], c[-1], min(loop[c[0]], loop[c[-1]])):
            for a, b in zip(c[:-1], c[1:]):
                g.add(a, b)
    return g


def prune(g, lim, keep):
    """rounds: every dangling branch shorter than lim that ends on a junction; each junction drops its shortest (tie: lower tip)"""
    while True:
        cand = {}
        for v in list(g.adj):
            if len(g.adj.get(v, ())) != 1 or v in keep:
                continue
            c = [v, next(iter(g.adj[v]))]
            l = g.adj[c[0]][c[1]]
            while len(g.adj[c[-1]]) == 2 and l < lim:
                w = [x for x in g.adj[c[-1]] if x != c[-2]][0]
                l += g.adj[c[-1]][w]; c.append(w)
            if l < lim and len(g.adj[c[-1]]) >= 3:
                j = c[-1]
                if j not in cand or (l, v) < cand[j][0]:
                    cand[j] = ((l, v), c)
        if not cand:
            return
        for j in sorted(cand):
            c = cand[j][1]
            for a, b in zip(c[:-1], c[1:]):
                g.rem(a, b)


def components(g):
    seen = set(); out = []
    for v in sorted(g.adj):
        if v in seen:
            continue
        st = [v]; seen.add(v); comp = []
        while st:
            u = st.pop(); comp.append(u)
            for w in g.adj[u]:
                if w not in seen:
                    seen.add(w); st.append(w)
        out.append(sorted(comp))
    return out


def chains(g, corners=()):
    stop = lambda v: len(g.adj[v]) != 2 or v in corners
    seen = set(); out = []
    for v in sorted(g.adj):
        if not stop(v):
            continue
        for u in sorted(g.adj[v]):
            if (v, u) in seen:
                continue
            c = [v, u]
            while not stop(c[-1]):
                c.append([w for w in g.adj[c[-1]] if w != c[-2]][0])
            seen.add((c[0], c[1])); seen.add((c[-1], c[-2])); out.append(c)
    used = {x for c in out for x in c}
    for v in sorted(g.adj):
        if v in used:
            continue
        c = [v, min(g.adj[v])]
        while c[-1] != v:
            c.append([w for w in g.adj[c[-1]] if w != c[-2]][0])
        used.update(c); out.append(c)
    return out


@njit(cache=True)
def relax(X, vvp, vv, go, reach):
    """half way to the mean of the neighbours within reach, where go"""
    O = X.copy()
    for v in range(X.shape[0]):
        if not go[v]:
            continue
        a = 0.0; b = 0.0; c = 0.0; m = 0
        for i in range(vvp[v], vvp[v + 1]):
            u = vv[i]
            e0 = X[u, 0] - X[v, 0]; e1 = X[u, 1] - X[v, 1]; e2 = X[u, 2] - X[v, 2]
            if e0 * e0 + e1 * e1 + e2 * e2 <= reach * reach:
                a += X[u, 0]; b += X[u, 1]; c += X[u, 2]; m += 1
        if m > 0:
            O[v, 0] = 0.5 * X[v, 0] + 0.5 * (a / m); O[v, 1] = 0.5 * X[v, 1] + 0.5 * (b / m); O[v, 2] = 0.5 * X[v, 2] + 0.5 * (c / m)
    return O


def unit(x):
    return x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)


def detect(V, F, mesh=None, **kw):
    p = dict(DEFAULT); p.update(kw)
    m = mesh or Mesh(V, F)
    r = find(m, refine(m, p), p)
    return {**r, **drawn(m, r, p)}


def find(m, refined, p):
    """steps B to E: from what refine() returns to the lines, with all fields in between"""
    h = m.h
    N, s0, K, Kv = refined
    T, NV = vote(m.V, m.C, N, m.A, m.vfp, m.vf, h)
    L, U = eig(T)
    NV = unit(NV)
    for _ in range(p['revote']):
        T = vote_twice(T, m.vvp, m.vv)
    L2, U2 = eig(T)
    t = unit(U2[:, :, 2] - (U2[:, :, 2] * NV).sum(1, keepdims=True) * NV)
    b = np.cross(NV, t)
    isb = np.zeros(len(m.V), bool); isb[m.bedge.ravel()] = True
    near, far = np.arctan(np.sqrt(L[:, 1])), np.arctan(np.sqrt(L2[:, 1]))
    bg = cell_level(m.V, near + far, p['cell'] * h, p['b_quant'], m.lo)(m.V)
    calm = p['k_bg'] * bg < p['calm'] * DEG
    more = np.where(calm, np.floor(p['wide'] * Kv), 0).astype(np.int64)
    for k in range(int(more.max(initial=0))):       # six neighbours and two own votes: who stands still weighs as much
        T = np.where((more > k)[:, None, None], vote_twice(T, m.vvp, m.vv) / 8, T)
    # mean fold angle at the two or three scales
    th = np.where(more > 0, (near + far + np.arctan(np.sqrt(eig(T)[0][:, 1]))) * (2 / 3), near + far)
    ph = 2 * np.arctan(np.sqrt(L[:, 2]))            # ball part as an angle
    cone = np.cos(p['cone'] * DEG)
    chi = contrast(m.V, m.vvp, m.vv, b, t, th, p['hops'] + np.floor(p['hops_k'] * Kv).astype(np.int64), np.cos(60 * DEG),
                   (p['reach'] + p['reach_k'] * Kv) * h)
    thr = np.minimum(np.maximum(p['t_min'] * DEG, p['k_bg'] * bg * (1 + p['wide_bg'] * more)), p['t_max'] * DEG)
    low = p['low'] * thr
    corner = (ph >= p['corner'] * DEG) & (ph >= p['c_rat'] * 2 * near)
    stop = corner | isb
    X = m.V
    smooth = np.where(isb, 0, np.minimum(p['relax_max'], np.floor(p['relax'] * Kv)))
    for k in range(int(smooth.max(initial=0))):
        X = relax(X, m.vvp, m.vv, smooth > k, p['relax_reach'] * h)
    S, SC = trace(X, m.vvp, m.vv, t, th, chi, low, stop, p['steps'], cone, np.cos(p['turn'] * DEG), p['lend'])
    q = np.minimum(S / thr, 1e9)
    sure = S >= p['sure'] * DEG                 # no smooth surface folds that much in a ring
    crest = (SC >= p['rho'] * S) | sure
    strong = (q >= p['q_hi']) & ((SC >= p['rho_hi'] * S) | sure)
    R = th
    turns = np.minimum(Kv, np.where(calm, p['along_calm'], p['along']))
    for k in range(int(turns.max(initial=0))):
        R = np.where(turns > k, along(m.V, m.vvp, m.vv, t, R), R)
    own = near >= p['own'] * np.maximum(0, 1 - Kv / p['own_k']) * far
    ridge = nms(m.V, m.vvp, m.vv, b, t, R, (q >= 1.0) & crest & own, p['nms_r'] * h, p['side']) & ~isb
    es = link(X, m.vvp, m.vv, t, R, ridge, stop, ((q >= p['q_link']) & ((SC >= p['c_link'] * p['rho'] * S) | sure)) | corner, cone, p['lsteps'])
    def weight(a, c):
        d = X[c] - X[a]
        al = 0.5 * (abs(d @ t[a]) + abs(d @ t[c])) / np.sqrt((d * d).sum())
        return min(R[a], R[c]) * (p['across'] + (1 - p['across']) * al)
    walks = []
    for a, c, i in es:
        if i == 0:
            walks.append([int(a)])
        walks[-1].append(int(c))
    paths = {}                                      # key: (steps, -smallest weight, vertices from the lower end)
    for c in walks:
        e = list(zip(c[:-1], c[1:]))
        if not any(isb[x] and isb[y] for x, y in e):
            c = tuple(c if c[0] < c[-1] else c[::-1])
            paths[(len(e), -min(weight(x, y) for x, y in e), c)] = c
    g = thin_graph(m.V, paths, (p['loop'] + p['loop_k'] * Kv) * h)
    keep = set(np.where(stop)[0].tolist())
    prune(g, p['prune'] * h, keep)
    for comp in components(g):
        tot = st = 0.0
        for a in comp:
            for c, l in g.adj[a].items():
                if a < c:
                    tot += l
                    if strong[a] and strong[c]:
                        st += l
        if tot < p['iso'] * h or st < p['strong_frac'] * tot:
            for a in comp:
                del g.adj[a]
    C = chains(g, set(np.where(corner)[0].tolist()) & set(g.adj))
    return dict(polylines=[m.V[np.array(c)] for c in C], chains=C, graph=g, l1=L[:, 0], l2=L[:, 1], l3=L[:, 2], omega=(L[:, 1] + L[:, 2]) / 2,
                s0=s0, K=K, Kv=Kv, thr=thr, theta=th, chi=chi, SC=SC, phi=ph, bg=bg, saliency=S, q=q, crest=crest, ridge=ridge, corner=corner,
                boundary=isb, N=N, t=t, b=b, mesh=m)


def drawn(m, r, p):
    """step F: angles and classes of the vertices, fitted lines. Fits at the vertices of lines and at features: dihedral angle (signed where
    there are two sides), quadric, slack"""
    C, g, corner, isb, th = r['chains'], r['graph'], r['corner'], r['boundary'], r['theta']
    feature = (r['q'] >= 1) & r['crest']
    angle = th.copy(); A = np.zeros((len(m.V), 3, 3)); a = np.zeros((len(m.V), 3))
    noise = np.minimum(r['Kv'] / fit.DEFAULT['noisy'], 1)
    for v in sorted(set(np.where(feature & ~corner & ~isb)[0].tolist()) | {v for c in C for v in c}):
        angle[v], _, A[v], a[v] = fit.fit(m, r['N'], v, r['t'][v], r['b'][v], corner[v], noise[v])
        if np.isnan(angle[v]):
            angle[v] = th[v]
    fitted = []
    for c in C:
        fixed = np.array([corner[v] or len(g.adj[v]) > 2 for v in c])
        round_ = c[0] == c[-1] and not fixed[0]
        i = np.array(c[1:] if round_ else c)
        x = fit.smooth(m.V[i] / m.h, A[i], a[i], fit.slack(noise[i]), fixed[1:] if round_ else fixed, round_) * m.h
        fitted.append(np.vstack([x[-1:], x]) if round_ else x)
    cls = np.zeros(len(m.V), np.int64)          # 0 face, 1 weak edge, 2 sharp edge, 3 corner, 4 boundary
    cls[feature] = 1
    cls[feature & (np.abs(angle) >= p['sharp'] * DEG)] = 2
    cls[corner] = 3; cls[isb] = 4
    return {'class': cls, 'fitted': fitted, 'angle': angle}
