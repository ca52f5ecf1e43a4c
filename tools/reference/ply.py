"""Binary PLY files as numpy arrays, shared by the reference and the renderer.
In: a binary PLY file of either byte order, any elements, any scalar or list properties in any order; or arrays by element.
Out: {element: structured array}, a list property being a field of shape (rows, length) where all its lists are equally long
and of dtype object where they are not; or a binary_little_endian file."""
import numpy as np

TYPES = dict(char='i1', uchar='u1', short='i2', ushort='u2', int='i4', uint='u4', float='f4', double='f8',
             int8='i1', uint8='u1', int16='i2', uint16='u2', int32='i4', uint32='u4', float32='f4', float64='f8')
NAMES = {v: k for k, v in list(TYPES.items())[:8]}


def header(f, path):
    """byte order and [(element, rows, [(property, type, count type or None)])]; leaves f at the first byte of the data"""
    if f.readline().strip() != b'ply':
        raise ValueError(f'{path}: not a PLY file')
    order, elements = None, []
    while True:
        line = f.readline()
        if not line:
            raise ValueError(f'{path}: header without end_header')
        w = line.decode('latin-1').split()
        if not w or w[0] in ('comment', 'obj_info'):
            continue
        if w[0] == 'end_header':
            break
        if w[0] == 'format':
            order = dict(binary_little_endian='<', binary_big_endian='>').get(w[1])
            if order is None:
                raise ValueError(f'{path}: format {w[1]}; only binary PLY is read')
        elif w[0] == 'element':
            elements.append((w[1], int(w[2]), []))
        elif w[0] == 'property' and w[1] == 'list':
            elements[-1][2].append((w[4], TYPES[w[3]], TYPES[w[2]]))
        elif w[0] == 'property':
            elements[-1][2].append((w[2], TYPES[w[1]], None))
    return order, elements


def read(path):
    with open(path, 'rb') as f:
        order, elements = header(f, path)
        at = f.tell()
    raw = np.memmap(path, np.uint8, 'r')
    out = {}
    for name, n, props in elements:
        need = sum(np.dtype(c or t).itemsize for _, t, c in props) * n
        if at + (0 if any(c for _, _, c in props) else need) > len(raw):
            raise ValueError(f'{path}: ends inside element {name}')
        rows, size = _uniform(raw, at, n, props, order)
        if rows is None:
            rows, size = _ragged(raw, at, n, props, order)
        out[name] = rows
        at += size
    return out


def _uniform(raw, at, n, props, order):
    """all rows at once, with the list lengths of the first row; None if they do not hold for all rows"""
    if n == 0:      # triangles stand for lists of unknown length
        return np.zeros(0, [(p, t, (3,)) if c else (p, t) for p, t, c in props]), 0
    d, p0 = [], at
    for p, t, c in props:
        if c:
            k = int(np.frombuffer(raw, order + c, 1, p0)[0])
            d.append((p + '#', order + c)); d.append((p, order + t, (k,)))
            p0 += np.dtype(c).itemsize + k * np.dtype(t).itemsize
        else:
            d.append((p, order + t)); p0 += np.dtype(t).itemsize
    d = np.dtype(d)
    if at + n * d.itemsize > len(raw):
        return None, 0
    rows = np.frombuffer(raw, d, n, at)
    for p, _, c in props:
        if c and (rows[p + '#'] != rows[p + '#'][0]).any():
            return None, 0
    return rows, n * d.itemsize


def _ragged(raw, at, n, props, order):
    rows = np.zeros(n, [(p, object if c else t) for p, t, c in props])
    p0 = at
    for i in range(n):
        for p, t, c in props:
            k = 1
            if c:
                k = int(np.frombuffer(raw, order + c, 1, p0)[0]); p0 += np.dtype(c).itemsize
            x = np.frombuffer(raw, order + t, k, p0); p0 += k * np.dtype(t).itemsize
            rows[p][i] = x if c else x[0]
    return rows, p0 - at


def write(path, elements):
    """elements: {element: {property: array}}; a two-dimensional array becomes a list property with uchar counts"""
    head, blocks = ['ply', 'format binary_little_endian 1.0'], []
    for name, cols in elements.items():
        cols = {p: np.asarray(x) for p, x in cols.items()}
        n = len(next(iter(cols.values())))
        head.append(f'element {name} {n}')
        d = []
        for p, x in cols.items():
            t = x.dtype.str[1:]
            if x.ndim == 2:
                head.append(f'property list uchar {NAMES[t]} {p}')
                d += [(p + '#', 'u1'), (p, '<' + t, (x.shape[1],))]
            else:
                head.append(f'property {NAMES[t]} {p}')
                d.append((p, '<' + t))
        rows = np.zeros(n, d)
        for p, x in cols.items():
            rows[p] = x
            if x.ndim == 2:
                rows[p + '#'] = x.shape[1]
        blocks.append(rows.tobytes())
    with open(path, 'wb') as f:
        f.write('\n'.join(head + ['end_header\n']).encode() + b''.join(blocks))


def points(rows):
    """coordinates of an element vertex as f64"""
    return np.stack([rows[c].astype(np.float64) for c in 'xyz'], 1)


def mesh(path):
    """vertices (f64) and triangles (i64) of a triangle mesh"""
    d = read(path)
    f = d['face']
    name = next(p for p in ('vertex_indices', 'vertex_index') if p in f.dtype.names)
    F = f[name]
    if F.ndim != 2 or F.shape[1] != 3:
        raise ValueError(f'{path}: not all faces are triangles')
    F = F.astype(np.int64)
    V = points(d['vertex'])
    if len(F) and (F.min() < 0 or F.max() >= len(V)):
        raise ValueError(f'{path}: a face refers to a vertex that does not exist')
    return V, F
