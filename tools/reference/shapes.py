"""Procedural CAD shapes with known feature lines (mesh scale: target edge length h = 1).
In: the name of a shape and a seed. Out: vertices, faces, true lines. Run as a script it lists all shapes."""
import numpy as np
import triangle as _tri


def _subdivide(a, b, rng, h=1.0, jit=0.22):
    """jittered subdivision of segment a-b (any dim) into pieces of about h; includes a, excludes b"""
    a = np.asarray(a, float); b = np.asarray(b, float)
    n = max(1, int(round(np.linalg.norm(b - a) / h)))
    t = np.arange(n) / n
    if n > 1:
        t[1:] += (rng.random(n - 1) - 0.5) * 2 * jit / n
    return a[None] + t[:, None] * (b - a)[None]


def _tri2d(loops, lines, holes, area=0.62, q=22):
    """constrained quality Delaunay; loops closed rings, lines open polylines; boundary points are kept as given"""
    pts, segs = [], []
    base = 0
    for L in loops:
        n = len(L); pts.append(L)
        segs += [(base + i, base + (i + 1) % n) for i in range(n)]; base += n
    for L in lines:
        n = len(L); pts.append(L)
        segs += [(base + i, base + i + 1) for i in range(n - 1)]; base += n
    P = np.vstack(pts)
    U, inv = np.unique(np.round(P, 9), axis=0, return_inverse=True)
    inv = np.asarray(inv).ravel()
    S = inv[np.asarray(segs)]
    S = S[S[:, 0] != S[:, 1]]
    d = dict(vertices=U, segments=S)
    if len(holes):
        d['holes'] = np.asarray(holes, float)
    r = _tri.triangulate(d, 'pYYq%da%g' % (q, area))
    return r['vertices'], r['triangles']


class Builder:
    def __init__(self):
        self.P, self.F, self.n, self.lines = [], [], 0, []

    def add(self, P, F):
        self.P.append(P); self.F.append(F + self.n); self.n += len(P)

    def finish(self):
        P = np.vstack(self.P); F = np.vstack(self.F)
        _, first, inv = np.unique(np.round(P, 6), axis=0, return_index=True, return_inverse=True)
        inv = np.asarray(inv).ravel()
        V = P[first]; F = inv[F]
        ok = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
        return V, F[ok]

    def planar(self, loops, lines=(), holes=(), lift=None, flip=False):
        P2, T = _tri2d(list(loops), list(lines), list(holes))
        P3 = lift(P2)
        if flip:
            T = T[:, ::-1]
        self.add(P3, T)


def extrude(rings, height, rng, hole_pts=()):
    """rings: list of list of (x, y, sharp) polygon corners (first CCW outer, rest CW holes).
    consecutive corners are subdivided at ~h (smooth arcs are given already at ~h)."""
    B = Builder(); loops = []
    for ring in rings:
        loop, corner = [], []
        m = len(ring)
        for i in range(m):
            a = ring[i]; b = ring[(i + 1) % m]
            s = _subdivide(a[:2], b[:2], rng)
            for j, p in enumerate(s):
                loop.append(p); corner.append((j == 0) and a[2])
        loops.append((np.array(loop), np.array(corner)))
    L2 = [l for l, _ in loops]
    for z, fl in ((0.0, True), (height, False)):
        B.planar(L2, holes=hole_pts, lift=lambda P, z=z: np.c_[P, np.full(len(P), z)], flip=fl)
        for l in L2:
            B.lines.append(np.c_[np.vstack([l, l[:1]]), np.full(len(l) + 1, z)])
    for l, c in loops:
        q = np.vstack([l, l[:1]])
        s = np.r_[0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))]
        # vertical subdivision shared: seam at index 0 and at each sharp corner
        cuts = [0] + [i for i in range(1, len(l)) if c[i]] + [len(l)]
        vert = {}
        for k in cuts:
            kk = k % len(l)
            if kk not in vert:
                zz = _subdivide([0.0], [height], rng)[:, 0]
                vert[kk] = np.r_[zz, height]
                if c[kk]:
                    B.lines.append(np.c_[np.tile(l[kk], (2, 1)), [0.0, height]])
        for k0, k1 in zip(cuts[:-1], cuts[1:]):
            bot = np.c_[s[k0:k1 + 1], np.zeros(k1 - k0 + 1)]
            top = np.c_[s[k0:k1 + 1], np.full(k1 - k0 + 1, height)][::-1]
            rgt = np.c_[np.full(len(vert[k1 % len(l)]), s[k1]), vert[k1 % len(l)]][1:-1]
            lft = np.c_[np.full(len(vert[k0 % len(l)]), s[k0]), vert[k0 % len(l)]][1:-1][::-1]
            ring2 = np.vstack([bot, rgt, top, lft])

            def lift(P, s=s, q=q, l=l):
                # exact coordinates at ring parameter values; arcs interpolated on the chord
                i = np.clip(np.searchsorted(s, P[:, 0] + 1e-9) - 1, 0, len(q) - 2)
                t = (P[:, 0] - s[i]) / (s[i + 1] - s[i]); t = np.clip(t, 0, 1)
                xy = q[i] * (1 - t)[:, None] + q[i + 1] * t[:, None]
                return np.c_[xy, P[:, 1]]
            B.planar([ring2], lift=lift)
    V, F = B.finish()
    return V, F, B.lines


def arc(cx, cy, r, a0, a1, n, sharp_ends=False, rng=None):
    a = np.linspace(a0, a1, n + 1)
    return [(cx + r * np.cos(x), cy + r * np.sin(x), False) for x in a]


def snap_arc(V, circles):
    """push the vertices of smooth walls from the chord to the true circle"""
    for cx, cy, r, test in circles:
        d = V[:, :2] - [cx, cy]; R = np.linalg.norm(d, axis=1)
        m = test(V) & (np.abs(R - r) < 0.2) & (R > 1e-9)
        V[m, :2] = [cx, cy] + d[m] / R[m, None] * r
    return V


def shape(name, seed=1):
    rng = np.random.default_rng(abs(hash_name(name)) + seed)
    S = True
    if name == 'box':
        return extrude([[(0, 0, S), (34, 0, S), (34, 28, S), (0, 28, S)]], 24.0, rng)
    if name == 'hexprism':
        r = 20.0
        return extrude([[(r * np.cos(a), r * np.sin(a), S) for a in np.arange(6) * np.pi / 3]], 26.0, rng)
    if name == 'bracket':
        n = 22; r = 4.0
        hole = [(30 + r * np.cos(a), 6 + r * np.sin(a), False) for a in -np.arange(n) * 2 * np.pi / n]
        return extrude([[(0, 0, S), (38, 0, S), (38, 12, S), (12, 12, S), (12, 38, S), (0, 38, S)], hole], 16.0, rng, [(30, 6)])
    if name == 'cylinder':
        r = 14.0; n = 84
        a = np.arange(n) * 2 * np.pi / n
        V, F, L = extrude([[(r * np.cos(x), r * np.sin(x), False) for x in a]], 30.0, rng)
        side = (V[:, 2] > 1e-6) & (V[:, 2] < 30 - 1e-6)
        d = np.linalg.norm(V[side, :2], axis=1, keepdims=True)
        V[side, :2] *= r / d
        return V, F, L
    if name == 'rounded':
        r = 6.0
        A = arc(34 - r, 28 - r, r, 0, np.pi / 2, 9)
        ring = [(0, 0, S), (34, 0, S)] + A + [(0, 28, S)]
        V, F, L = extrude([ring], 24.0, rng)
        m = (V[:, 0] > 34 - r - 1e-9) & (V[:, 1] > 28 - r - 1e-9) & (V[:, 2] > 1e-6) & (V[:, 2] < 24 - 1e-6)
        d = V[m, :2] - [34 - r, 28 - r]
        V[m, :2] = [34 - r, 28 - r] + d * (r / np.linalg.norm(d, axis=1, keepdims=True))
        return V, F, L
    if name.startswith('fold'):
        ang = np.radians(float(name[4:])); width = 18.0; k = 4; ly = 60.0
        B = Builder()
        xs = np.arange(k + 2) * width
        outer = np.vstack([_subdivide((0, 0), (xs[-1], 0), rng), _subdivide((xs[-1], 0), (xs[-1], ly), rng),
                           _subdivide((xs[-1], ly), (0, ly), rng), _subdivide((0, ly), (0, 0), rng)])
        # let fold lines end at exact boundary points
        for x in xs[1:-1]:
            for y in (0, ly):
                m = np.where(np.abs(outer[:, 1] - y) < 1e-9)[0]
                j = m[np.argmin(np.abs(outer[m, 0] - x))]
                outer[j] = (x, y)
        lines = [np.vstack([_subdivide((x, 0), (x, ly), rng), [(x, ly)]]) for x in xs[1:-1]]
        slope = np.array([(ang / 2) * (1 if i % 2 else -1) for i in range(k + 1)])
        dx, dz = np.cos(slope) * width, np.sin(slope) * width
        X = np.r_[0, np.cumsum(dx)]; Z = np.r_[0, np.cumsum(dz)]

        def lift(P):
            i = np.clip((P[:, 0] / width).astype(int), 0, k)
            u = P[:, 0] - i * width
            return np.c_[X[i] + u * np.cos(slope[i]), P[:, 1], Z[i] + u * np.sin(slope[i])]
        B.planar([outer], lines, lift=lift)
        for i in range(1, k + 1):
            B.lines.append(np.array([[X[i], 0, Z[i]], [X[i], ly, Z[i]]]))
        V, F = B.finish()
        return V, F, B.lines
    if name == 'cone':
        r, H, n = 22.0, 26.0, 136
        a = np.arange(n) * 2 * np.pi / n
        sl = np.hypot(r, H); B = Builder()
        ring = np.c_[r * np.cos(a), r * np.sin(a)]
        B.planar([ring], lift=lambda P: np.c_[P, np.zeros(len(P))], flip=True)
        sc = sl / r
        # cone side: triangulate the flattened disc of radius sl with equal-arc ring, then map (keeps radial length; arc shrinks)
        radii = np.arange(1, int(sl)) / int(sl) * r
        P = [np.zeros((1, 2))]
        for q in radii:
            m = max(5, int(round(2 * np.pi * q)))
            b = (np.arange(m) + rng.random()) * 2 * np.pi / m + (rng.random(m) - .5) * 0.5 / max(q, 1)
            rr = q + (rng.random(m) - .5) * 0.35 * r / sl * (q < radii[-1] - 1e-9)
            P.append(np.c_[rr * np.cos(b), rr * np.sin(b)])
        P.append(ring); P = np.vstack(P)
        from scipy.spatial import Delaunay
        T = Delaunay(P).simplices
        o = np.cross(np.c_[P[T[:, 1]] - P[T[:, 0]], np.zeros(len(T))], np.c_[P[T[:, 2]] - P[T[:, 0]], np.zeros(len(T))])[:, 2]
        T = np.where((o > 0)[:, None], T, T[:, ::-1])
        T = T[np.abs(o) > 1e-9]
        R = np.linalg.norm(P, axis=1)
        B.add(np.c_[P, H * (1 - R / r) * (R < r - 1e-9)], T)
        B.lines.append(np.c_[np.vstack([ring, ring[:1]]), np.zeros(n + 1)])
        V, F = B.finish()
        return V, F, B.lines
    if name == 'city':
        B = Builder(); W = 96.0
        terr = lambda x, y: 1.6 * np.sin(x * 0.075) * np.cos(y * 0.06) + 0.9 * np.sin(0.11 * y + 0.05 * x)
        outer = np.vstack([_subdivide(p, q, rng) for p, q in zip([(0, 0), (W, 0), (W, W), (0, W)], [(W, 0), (W, W), (0, W), (0, 0)])])
        foot, hp = [], []
        for gx in range(3):
            for gy in range(3):
                x0 = 9 + gx * 30 + rng.random() * 3; y0 = 9 + gy * 30 + rng.random() * 3
                w = 13 + rng.random() * 4; d = 16 + rng.random() * 3
                eave = 9 + rng.random() * 4; roof = 0.0 if (gx + gy) % 3 == 2 else 3.5 + 2 * rng.random()
                foot.append((x0, y0, w, d, eave, roof)); hp.append((x0 + w / 2, y0 + d / 2))
        loops = [outer]
        for (x0, y0, w, d, ev, rf) in foot:
            cs = [(x0, y0), (x0 + w, y0), (x0 + w, y0 + d), (x0, y0 + d)]
            es = [_subdivide(cs[i], cs[(i + 1) % 4], rng) for i in range(4)]
            if rf > 0:   # make the gable ends contain the middle point
                for i in (0, 2):
                    mid = (np.array(cs[i]) + cs[(i + 1) % 4]) / 2
                    j = np.argmin(np.linalg.norm(es[i] - mid, axis=1)); es[i][j] = mid
            loops.append(np.vstack(es))
            zt = [np.r_[_subdivide([terr(*c)], [ev], rng)[:, 0], ev] for c in cs]
            tops = []
            for i in range(4):
                a, b = np.array(cs[i]), np.array(cs[(i + 1) % 4])
                e = np.vstack([es[i], b[None]]); s = np.linalg.norm(e - a, axis=1)
                bot = np.c_[s, terr(e[:, 0], e[:, 1])]
                topz = np.full(len(e), ev)
                if rf > 0 and i in (0, 2):
                    topz = ev + rf * (1 - np.abs(s / s[-1] - 0.5) * 2)
                # resample the top: subdivide its own segments (roof slopes)
                if rf > 0 and i in (0, 2):
                    m = s[-1] / 2
                    tp = np.vstack([_subdivide((0, ev), (m, ev + rf), rng), _subdivide((m, ev + rf), (s[-1], ev), rng), [(s[-1], ev)]])
                else:
                    tp = np.vstack([_subdivide((0, ev), (s[-1], ev), rng), [(s[-1], ev)]])
                rg = np.c_[np.full(len(zt[(i + 1) % 4]), s[-1]), zt[(i + 1) % 4]][1:-1]
                lf = np.c_[np.zeros(len(zt[i])), zt[i]][1:-1][::-1]
                dirv = (b - a) / s[-1]
                lift = lambda P, a=a, dirv=dirv: np.c_[a + P[:, :1] * dirv, P[:, 1]]
                B.planar([np.vstack([bot, rg, tp[::-1], lf])], lift=lift)
                t3 = lift(tp); tops.append(t3)
                B.lines.append(t3); B.lines.append(np.c_[e, bot[:, 1]])
                B.lines.append(np.c_[np.tile(a, (2, 1)), [terr(*a), ev]])
            if rf <= 0:
                ring = np.vstack([t[:-1, :2] for t in tops])
                B.planar([ring], lift=lambda P, ev=ev: np.c_[P, np.full(len(P), ev)])
            else:
                mx = x0 + w / 2
                rid = np.vstack([_subdivide((mx, y0), (mx, y0 + d), rng), [(mx, y0 + d)]])
                B.lines.append(np.c_[rid, np.full(len(rid), ev + rf)])
                f0, f1 = tops[0], tops[2]
                k0 = np.argmax(f0[:, 2]); k1 = np.argmax(f1[:, 2])
                right = np.vstack([f0[k0:, :2], tops[1][1:, :2], f1[1:k1 + 1, :2], rid[::-1][1:-1]])
                left = np.vstack([rid[:-1], f1[k1:, :2], tops[3][1:, :2], f0[1:k0, :2]])
                lz = lambda P, x0=x0, w=w, ev=ev, rf=rf: np.c_[P, ev + rf * (1 - np.abs((P[:, 0] - x0) / w - 0.5) * 2)]
                st = np.hypot(w / 2, rf) / (w / 2)
                for ring in (right, left):
                    B.planar([ring], lift=lz)
        B.planar(loops, holes=hp, lift=lambda P: np.c_[P, terr(P[:, 0], P[:, 1])])
        V, F = B.finish()
        return V, F, B.lines
    if name == 'torus':
        R, r = 20.0, 8.0
        nu, nv = 126, 50
        u, v = np.meshgrid(np.arange(nu), np.arange(nv), indexing='ij')
        uu = (u + 0.3 * (rng.random(u.shape) - .5)) * 2 * np.pi / nu
        vv = (v + 0.5 * (u % 2) + 0.3 * (rng.random(u.shape) - .5)) * 2 * np.pi / nv
        V = np.stack([(R + r * np.cos(vv)) * np.cos(uu), (R + r * np.cos(vv)) * np.sin(uu), r * np.sin(vv)], -1).reshape(-1, 3)
        F = []
        idx = lambda i, j: (i % nu) * nv + (j % nv)
        for i in range(nu):
            for j in range(nv):
                a, b = idx(i, j), idx(i, j + 1)
                if i % 2 == 0:
                    c, d = idx(i + 1, j), idx(i + 1, j - 1)
                    F += [(a, c, b), (a, d, c)]
                else:
                    c, d = idx(i + 1, j + 1), idx(i + 1, j)
                    F += [(a, d, c), (a, c, b)]
        return V, np.array(F), []
    raise ValueError(name)


def hash_name(s):
    h = 0
    for c in s:
        h = (h * 131 + ord(c)) % 1000003
    return h


ALL = ['box', 'hexprism', 'bracket', 'cylinder', 'rounded', 'cone', 'city', 'fold20', 'fold10', 'fold5', 'torus']


def vertex_normals(V, F):
    n = np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]])
    N = np.zeros_like(V)
    for k in range(3):
        np.add.at(N, F[:, k], n)
    l = np.linalg.norm(N, axis=1, keepdims=True); l[l == 0] = 1
    return N / l


def mean_edge(V, F):
    E = np.unique(np.sort(np.vstack([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1), axis=0)
    return np.linalg.norm(V[E[:, 0]] - V[E[:, 1]], axis=1).mean()


def noisy(V, F, a, seed=7):
    if a == 0:
        return V.copy()
    rng = np.random.default_rng(seed)
    return V + vertex_normals(V, F) * (rng.standard_normal(len(V)) * a * mean_edge(V, F))[:, None]


if __name__ == '__main__':
    for n in ALL:
        V, F, L = shape(n)
        E = np.sort(np.vstack([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        c = np.unique(E, axis=0, return_counts=True)[1]
        print(n, len(V), 'vertices', len(F), 'faces', 'mean edge %.3f' % mean_edge(V, F), 'boundary edges', (c == 1).sum(),
              'line length %.0f' % sum(np.linalg.norm(np.diff(l, axis=0), axis=1).sum() for l in L))
