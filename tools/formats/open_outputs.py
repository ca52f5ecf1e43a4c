"""Opens every output of crease with programs that people use, and compares what they see with the PLY file of the lines.

In: the program, and a mesh. Out: a markdown table, a row for each program and file. The exit code is 1 if something differs.
"""

import os
import re
import struct
import subprocess
import sys
import tempfile
from collections import Counter
from importlib.metadata import version
from pathlib import Path

import ezdxf
import meshio
import numpy as np
import pyogrio
import trimesh
import vtk
from plyfile import PlyData
from vtk.util.numpy_support import vtk_to_numpy

CRS = "EPSG:28992"
NAMES = {1: "weak", 2: "sharp", 4: "boundary", 5: "non-manifold"}
LAYERS = {"weak": "CREASE_WEAK", "sharp": "CREASE_SHARP", "boundary": "CREASE_BOUNDARY", "non-manifold": "CREASE_NONMANIFOLD"}
FORMATS = ["ply", "obj", "vtp", "dxf", "geojson", "gpkg", "csv"]


class Lines:
    """The lines of a PLY file: what all others are compared with."""

    def __init__(self, path):
        ply = PlyData.read(str(path))
        vertex, edge, line = (ply[name].data for name in ("vertex", "edge", "line"))
        self.vertex, self.line = vertex, line
        self.points = np.column_stack([vertex[axis] for axis in "xyz"])
        self.indices = []
        for record in line:
            edges = edge[record["first_edge"] :][: record["edges"]]
            self.indices.append(np.append(edges["vertex1"], edges["vertex2"][-1]))
        self.polylines = [self.points[indices] for indices in self.indices]
        self.classes = [NAMES[int(c)] for c in line["class"]]


def same_polylines(found, expected):
    return len(found) == len(expected) and all(np.array_equal(a, b) for a, b in zip(found, expected))


def length(points):
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def polydata(reader, path):
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    points = vtk_to_numpy(data.GetPoints().GetData())
    cells = data.GetLines()
    connectivity = vtk_to_numpy(cells.GetConnectivityArray())
    offsets = vtk_to_numpy(cells.GetOffsetsArray())
    return data, points, [connectivity[a:b] for a, b in zip(offsets, offsets[1:])]


def vtp(path, lines):
    data, points, indices = polydata(vtk.vtkXMLPolyDataReader(), path)
    arrays = {}
    for name, found in (("point", data.GetPointData()), ("line", data.GetCellData())):
        arrays[name] = {found.GetArrayName(i): vtk_to_numpy(found.GetArray(i)) for i in range(found.GetNumberOfArrays())}
    same = np.array_equal(points, lines.points)
    same &= all(np.array_equal(a, b) for a, b in zip(indices, lines.indices)) and len(indices) == len(lines.indices)
    same &= all(np.array_equal(array, lines.vertex[name]) for name, array in arrays["point"].items())
    same &= all(np.array_equal(array, lines.line[name]) for name, array in arrays["line"].items())
    saw = f"{len(points)} points, {len(indices)} lines; per point {', '.join(arrays['point'])}; per line {', '.join(arrays['line'])}"
    return saw, same and len(arrays["point"]) == 5 and len(arrays["line"]) == 7


def obj_vtk(path, lines):
    _, points, indices = polydata(vtk.vtkOBJReader(), path)
    # The reader keeps coordinates as float.
    same = np.array_equal(points.astype(np.float32), lines.points.astype(np.float32))
    same &= len(indices) == len(lines.indices) and all(np.array_equal(a, b) for a, b in zip(indices, lines.indices))
    return f"{len(points)} points, {len(indices)} lines, the longest of {max(map(len, indices))} points", same


def dxf(path, lines):
    document = ezdxf.readfile(str(path))
    auditor = document.audit()
    found = list(document.modelspace().query("POLYLINE"))
    polylines = []
    for entity in found:
        points = np.array([vertex.dxf.location for vertex in entity.vertices], dtype=float)
        polylines.append(np.vstack([points, points[:1]]) if entity.is_closed else points)
    same = same_polylines(polylines, lines.polylines) and all(entity.is_3d_polyline for entity in found)
    same &= [entity.dxf.layer for entity in found] == [LAYERS[name] for name in lines.classes]
    layers = Counter(entity.dxf.layer for entity in found)
    counted = ", ".join(f"{count} on {name}" for name, count in sorted(layers.items()))
    problems = len(auditor.errors) + len(auditor.fixes)
    saw = f"{document.dxfversion}, {len(found)} 3D polylines ({counted}), {sum(e.is_closed for e in found)} closed; "
    saw += f"auditor: {len(auditor.errors)} errors, {len(auditor.fixes)} fixes"
    return saw, same and problems == 0


def wkb_points(wkb):
    order = "<" if wkb[0] == 1 else ">"
    kind, count = struct.unpack_from(order + "II", wkb, 1)
    assert kind in (1002, 0x80000002), kind
    return np.frombuffer(wkb, dtype=order + "f8", count=3 * count, offset=9).reshape(count, 3)


def gdal(path, lines, crs):
    info = pyogrio.read_info(str(path), force_total_bounds=True)
    meta, _, geometry, fields = pyogrio.raw.read(str(path))
    table = dict(zip(meta["fields"], fields))
    polylines = [wkb_points(wkb) for wkb in geometry]
    same = same_polylines(polylines, lines.polylines) and info["crs"] == crs
    same &= list(table["class"]) == lines.classes
    for name in ("id", "length", "strength", "angle"):
        same &= np.array_equal(np.asarray(table[name], dtype=float), lines.line[name].astype(float))
    bounds = np.concatenate([lines.points.min(axis=0)[:2], lines.points.max(axis=0)[:2]])
    same &= np.array_equal(np.array(info["total_bounds"]), bounds)
    total = sum(map(length, polylines))
    saw = f"{info['features']} features, {info['geometry_type']}, CRS {info['crs'] or 'none'}, fields {', '.join(table)}, "
    saw += f"length {total:.2f}; extent {', '.join(f'{x:.2f}' for x in info['total_bounds'])}"
    return saw, same


def dxf_gdal(path, lines):
    meta, _, geometry, fields = pyogrio.raw.read(str(path))
    layers = dict(zip(meta["fields"], fields))["Layer"]
    same = same_polylines([wkb_points(wkb) for wkb in geometry], lines.polylines)
    same &= list(layers) == [LAYERS[name] for name in lines.classes]
    return f"{len(geometry)} features, {meta['geometry_type']}, on layers {', '.join(sorted(set(layers)))}", same


def gdal_window(path, lines):
    """Through the spatial index: features that meet the lower left quarter."""
    low, high = lines.points.min(axis=0)[:2], lines.points.max(axis=0)[:2]
    middle = (low + high) / 2
    box = (*low, *middle)
    _, _, geometry, _ = pyogrio.raw.read(str(path), bbox=box)
    meets = [p for p in lines.polylines if np.all(p.min(axis=0)[:2] <= middle) and np.all(p.max(axis=0)[:2] >= low)]
    return f"{len(geometry)} features in a window, {len(meets)} whose boxes meet it", 0 < len(geometry) <= len(meets)


def gpkg_validator(path):
    """GDAL's own check of a GeoPackage against the specification."""
    python = os.environ.get("GDAL_PYTHON", "/usr/bin/python3")
    known = subprocess.run([python, "-c", "import osgeo, osgeo_utils; print(osgeo.__version__)"], capture_output=True, text=True)
    if known.returncode != 0:
        return None
    done = subprocess.run([python, "-m", "osgeo_utils.samples.validate_gpkg", "--warning-as-error", str(path)], capture_output=True, text=True)
    said = (done.stdout + done.stderr).strip().splitlines()
    # Python tells those who run a module as a program about it.
    said = [line for line in said if "RuntimeWarning" not in line and not line.startswith("  warn")]
    return known.stdout.strip(), "; ".join(said) or "no complaint", done.returncode == 0


def annotated_trimesh(path, original):
    mesh = trimesh.load(str(path), process=False)
    data = mesh.metadata["_ply_raw"]["vertex"]["data"]
    saw = f"{len(mesh.vertices)} vertices, {len(mesh.faces)} faces; of vertices {', '.join(data.dtype.names)}"
    return saw, {"saliency", "class", "line"} <= set(data.dtype.names) and len(mesh.faces) == len(original["face"].data)


def annotated_meshio(path, original):
    mesh = meshio.read(str(path))
    faces = sum(len(block.data) for block in mesh.cells)
    saw = f"{len(mesh.points)} vertices, {faces} faces; of vertices {', '.join(mesh.point_data)}"
    return saw, {"saliency", "class", "line"} <= set(mesh.point_data) and faces == len(original["face"].data)


def annotated_lines(path, original, lines):
    """The mesh is what it was, and the properties are those of the lines."""
    ply = PlyData.read(str(path))
    vertex, before = ply["vertex"].data, original["vertex"].data
    same = all(np.array_equal(vertex[name], before[name]) for name in before.dtype.names)
    same &= all(np.array_equal(np.concatenate(ply["face"][p.name]), np.concatenate(original["face"][p.name])) for p in ply["face"].properties)
    same &= list(ply.comments) == list(original.comments)
    first = np.full(len(vertex), -1)
    for number, indices in reversed(list(enumerate(lines.indices))):
        first[lines.vertex["source"][indices]] = number
    same &= np.array_equal(vertex["line"], first)
    same &= np.array_equal(vertex["saliency"][lines.vertex["source"]], lines.vertex["saliency"])
    return f"{np.count_nonzero(first >= 0)} of {len(vertex)} vertices on a line", same


def rows(folder, crease, mesh):
    """Program, file, what it saw, whether that is right."""
    names = {kind: folder / f"lines.{kind}" for kind in FORMATS}
    annotated = folder / "annotated.ply"
    outputs = [word for name in names.values() for word in ("-o", name)]
    command = [crease, "detect", mesh, *outputs, "--annotate", annotated, "--crs", CRS, "--boundaries", "--quiet"]
    subprocess.run(command, check=True)
    lines, original = Lines(names["ply"]), PlyData.read(mesh)
    vtk_name = f"VTK {vtk.vtkVersion().GetVTKVersion()}"
    gdal_name = f"GDAL {'.'.join(map(str, pyogrio.__gdal_version__))}"
    yield vtk_name, "vtp", *vtp(names["vtp"], lines)
    yield vtk_name, "obj", *obj_vtk(names["obj"], lines)
    yield f"ezdxf {ezdxf.__version__}", "dxf", *dxf(names["dxf"], lines)
    yield gdal_name, "dxf", *dxf_gdal(names["dxf"], lines)
    yield gdal_name, "geojson", *gdal(names["geojson"], lines, CRS)
    yield gdal_name, "gpkg", *gdal(names["gpkg"], lines, CRS)
    yield gdal_name, "gpkg", *gdal_window(names["gpkg"], lines)
    checked = gpkg_validator(names["gpkg"])
    if checked:
        release, saw, right = checked
        yield f"GDAL {release} `validate_gpkg.py`", "gpkg", saw, right
    yield gdal_name, "csv", *gdal(names["csv"], lines, None)
    yield f"trimesh {trimesh.__version__}", "annotated ply", *annotated_trimesh(annotated, original)
    yield f"meshio {meshio.__version__}", "annotated ply", *annotated_meshio(annotated, original)
    yield f"plyfile {version('plyfile')}", "annotated ply", *annotated_lines(annotated, original, lines)


def main():
    crease, mesh = sys.argv[1:3]
    wrong = 0
    print("| program | file | what it saw | |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for program, kind, saw, right in rows(Path(folder), crease, mesh):
            wrong += not right
            saw = re.sub(re.escape(folder) + "/?", "", saw).replace("|", "\\|")
            print(f"| {program} | {kind} | {saw} | {'as in the PLY file' if right else 'WRONG'} |")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
