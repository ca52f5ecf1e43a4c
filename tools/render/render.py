"""Draws a mesh and its feature lines.
In: MESH.ply (binary triangle mesh) and LINES.ply (binary; element vertex x y z [class], element edge vertex1 vertex2 [line],
optional element line id class; other properties are ignored). Out: OUT.png, parallel projection, white background.
Lines: weak blue, sharp orange-red, boundary black, non-manifold magenta; corners are black dots. A file without element
line is drawn in red. --truth draws another such file below the lines as a wide green band."""
import argparse
import sys
from pathlib import Path
import numpy as np
import vtk
import pyvista as pv
from PIL import Image
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'reference'))
import ply  # noqa: E402

PLAIN, TRUTH = -1, -2
COLOURS = {1: '#1f5fd6', 2: '#d9300f', 4: '#000000', 5: '#d010c0', PLAIN: '#d9140f', TRUTH: '#6fd08c'}
vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_ERROR)      # it warns when there is no display

AXES = dict(z=[0, 1, 2], y=[2, 0, 1], x=[1, 2, 0])       # the ground axes, then the upward one
SAMPLES = 2                                              # pixels drawn per pixel and axis, on top of multisampling


def numbers(n, sep):
    def parse(s):
        x = [float(v) for v in s.split(sep)]
        if len(x) != n:
            raise argparse.ArgumentTypeError(f'{n} numbers separated by "{sep}" expected')
        return x
    return parse


def read_lines(path):
    """points, edges, class of each edge, positions of the corners"""
    d = ply.read(path)
    P, e = ply.points(d['vertex']), d['edge']
    E = np.stack([e['vertex1'], e['vertex2']], 1).astype(np.int64)
    cls = np.full(len(E), PLAIN)
    if 'line' in d and 'line' in e.dtype.names:
        of = d['line']
        ids = of['id'].astype(np.int64) if 'id' in of.dtype.names else np.arange(len(of))
        o = np.argsort(ids)
        at = np.searchsorted(ids[o], e['line'].astype(np.int64))
        if len(E) and (at.max() >= len(o) or (ids[o][at] != e['line']).any()):
            raise ValueError(f'{path}: an edge refers to a line that does not exist')
        cls = of['class'].astype(np.int64)[o][at]
    corner = d['vertex']['class'] == 3 if 'class' in d['vertex'].dtype.names else np.zeros(len(P), bool)
    return P, E, cls, P[corner]


def axes(azimuth, elevation):
    """unit vectors to the right, up and towards the viewer"""
    a, e = np.radians([azimuth, elevation])
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(back, right), back


def frame(V, view, size, zoom):
    """the parallel projection that fits V: axes, focus, half height, bounds in the projection"""
    W, H = size
    right, up, back = axes(*view)
    U = np.stack([V @ right, V @ up, V @ back], 1)
    lo, hi = U.min(0), U.max(0)
    half = max((hi[1] - lo[1]) / 2, (hi[0] - lo[0]) / 2 * H / W) * 1.04 / zoom
    focus = (right * (lo[0] + hi[0]) + up * (lo[1] + hi[1]) + back * (lo[2] + hi[2])) / 2
    return (right, up, back), focus, half if half > 0 else 1.0, lo, hi


def picture(mesh, lines, truth=None, size=(1600, 1000), view=(-60, 30), zoom=1.0, up_axis='z', crop=None, width=2.5,
            corners=True, plain=False):
    """the mesh with its lines as an array of pixels (H, W, 3); None if nothing of the mesh lies in the crop. plain: all
    lines in the colour of lines without a class"""
    # everything in f64 relative to the middle of the bounds, upward axis last
    V, F = ply.mesh(mesh)
    V = V[:, AXES[up_axis]]
    used = V[F.ravel()]
    lo, hi = used.min(0), used.max(0)
    mid = (lo + hi) / 2
    inside = lambda X: np.ones(len(X), bool)
    if crop:
        c0 = lo[:2] + np.array(crop[:2]) * (hi - lo)[:2]
        c1 = lo[:2] + np.array(crop[2:]) * (hi - lo)[:2]
        inside = lambda X: ((X[:, :2] >= c0) & (X[:, :2] <= c1)).all(1)
        F = F[inside(V[F].mean(1))]
        if not len(F):
            return None
    ids, F = np.unique(F, return_inverse=True)
    V, F = V[ids] - mid, F.reshape(-1, 3)

    # the view: fit the projection, then move lines towards the viewer (which does not move them in the picture)
    W, H = (int(x) for x in size)
    (right, up, back), focus, half, u0, u1 = frame(V, view, (W, H), zoom)
    pixel = 2 * half / H

    p = pv.Plotter(off_screen=True, window_size=(W * SAMPLES, H * SAMPLES), lighting='none')
    p.set_background('white')
    p.enable_anti_aliasing('msaa', multi_samples=4)
    # position relative to the camera: a key light from the upper left, a fill light from the front right
    for pos, strength in (((-0.9, 1.3, 1.2), 0.5), ((0.7, -0.1, 1.3), 0.42)):
        p.add_light(pv.Light(position=pos, intensity=strength, light_type='camera light'))
    p.add_mesh(pv.PolyData.from_regular_faces(V, F), color='#ececec', smooth_shading=False, ambient=0.3, diffuse=0.8,
               specular=0.0)

    def draw(path, width, lift, colour=None, dots=False):
        P, E, cls, marked = read_lines(path)
        P = P[:, AXES[up_axis]]; marked = marked[:, AXES[up_axis]]
        ok = inside(P[E].mean(1))
        E, cls = E[ok], cls[ok]
        P = P - mid + back * lift * pixel
        for k in sorted(set(cls.tolist())):
            i, e = np.unique(E[cls == k], return_inverse=True)
            d = pv.PolyData(P[i], lines=np.c_[np.full(len(e.reshape(-1, 2)), 2), e.reshape(-1, 2)].ravel())
            col = COLOURS.get(k if colour is None else colour, COLOURS[2])
            p.add_mesh(d, color=col, line_width=width * SAMPLES, lighting=False)
            # round joints
            p.add_mesh(pv.PolyData(P[i]), color=col, style='points', point_size=width * SAMPLES, lighting=False, render_points_as_spheres=True)
        marked = marked[inside(marked)] if len(marked) else marked
        if len(marked) and dots:
            p.add_mesh(pv.PolyData(marked - mid + back * (lift + 2) * pixel), color='black', style='points',
                       point_size=2.6 * width * SAMPLES, lighting=False, render_points_as_spheres=True)

    if truth:
        draw(truth, 2.6 * width, 2.5 * width, TRUTH)
    draw(lines, width, (8 if truth else 2) * width, PLAIN if plain else None, corners)

    far = np.linalg.norm(u1 - u0) + 20 * width * pixel
    p.camera.parallel_projection = True
    p.camera.focal_point = focus
    p.camera.position = focus + back * far
    p.camera.up = up
    p.camera.parallel_scale = half
    p.camera.clipping_range = (1e-3 * far, 2 * far)
    img = p.screenshot(None, return_img=True)
    p.close()
    img = img[:H * SAMPLES, :W * SAMPLES, :3].reshape(H, SAMPLES, W, SAMPLES, 3).mean((1, 3))
    return (img + 0.5).astype(np.uint8)


def main():
    a = argparse.ArgumentParser(description='draw a mesh and its feature lines')
    a.add_argument('mesh'); a.add_argument('lines'); a.add_argument('out')
    a.add_argument('--size', type=numbers(2, 'x'), default=[1600, 1000], metavar='WxH')
    a.add_argument('--view', type=numbers(2, ','), default=[-60, 30], metavar='AZIMUTH,ELEVATION',
                   help='where the viewer stands, degrees')
    a.add_argument('--zoom', type=float, default=1.0, help='1 fits the mesh')
    a.add_argument('--up', choices='zyx', default='z')
    a.add_argument('--truth', help='lines drawn below the others')
    a.add_argument('--crop', type=numbers(4, ','), metavar='X0,Y0,X1,Y1',
                   help='part of the bounds, as fractions along the ground axes (x,y; with --up y: z,x; with --up x: y,z)')
    a.add_argument('--width', type=float, default=2.5, help='width of the lines in pixels')
    a.add_argument('--no-corners', action='store_true', help='without the dots')
    a.add_argument('--colours', type=int, help='a palette of so many, for small files; 256 keep the lines as they are')
    argv = sys.argv[1:]
    for i in range(len(argv) - 1):          # a value that begins with a minus and is no number is taken for an option
        if argv[i] == '--view':
            argv[i:i + 2] = ['--view=' + argv[i + 1]]
            break
    a = a.parse_args(argv)
    img = picture(a.mesh, a.lines, a.truth, a.size, a.view, a.zoom, a.up, a.crop, a.width, not a.no_corners)
    if img is None:
        sys.exit('nothing of the mesh lies in the crop')
    img = Image.fromarray(img)
    if a.colours:       # without dithering, which would cost more bytes than the palette saves
        img = img.quantize(a.colours, dither=Image.Dither.NONE)
    img.save(a.out, optimize=True)


if __name__ == '__main__':
    main()
