"""Edges of a mesh whose dihedral angle exceeds a threshold, by one of several libraries.

In: the name of a library, a PLY file, an angle in degrees. Out: one line of JSON: what was found, and wall and processor
seconds of start (interpreter and imports), reading and finding. Each library is used as its documentation does it, with
what it does not need to do switched off.
"""

import json
import math
import sys
import time

BEGUN = time.perf_counter()


class Steps:
    """Wall and processor time from step to step; the interpreter's start counts for the first."""

    def __init__(self):
        self.wall, self.cpu, self.taken = BEGUN, 0.0, {}

    def done(self, name):
        wall, cpu = time.perf_counter(), time.process_time()
        self.taken[name] = {"wall": wall - self.wall, "cpu": cpu - self.cpu}
        self.wall, self.cpu = wall, cpu


def vtk(mesh, degrees, steps):
    # Modules one by one, which saves three quarters of the time that `import vtk` takes.
    from vtkmodules.vtkCommonCore import vtkVersion
    from vtkmodules.vtkFiltersCore import vtkFeatureEdges
    from vtkmodules.vtkIOPLY import vtkPLYReader

    steps.done("start")
    reader = vtkPLYReader()
    reader.SetFileName(mesh)
    reader.Update()
    steps.done("read")
    filter = vtkFeatureEdges()
    filter.SetInputConnection(reader.GetOutputPort())
    filter.SetFeatureAngle(degrees)
    filter.FeatureEdgesOn()
    filter.BoundaryEdgesOff()
    filter.NonManifoldEdgesOff()
    filter.ManifoldEdgesOff()
    filter.ColoringOff()
    filter.Update()
    edges = filter.GetOutput().GetNumberOfCells()
    steps.done("edges_found")
    return vtkVersion.GetVTKVersion(), reader.GetOutput().GetNumberOfCells(), edges


def igl(mesh, degrees, steps):
    import igl as library

    steps.done("start")
    vertices, faces = library.read_triangle_mesh(mesh)
    steps.done("read")
    edges = len(library.sharp_edges(vertices, faces, math.radians(degrees)))
    steps.done("edges_found")
    return version("libigl"), len(faces), edges


def meshlib(mesh, degrees, steps):
    import meshlib.mrmeshpy as library

    steps.done("start")
    read = library.loadMesh(mesh)
    steps.done("read")
    edges = read.findCreaseEdges(math.radians(degrees)).count()
    steps.done("edges_found")
    return version("meshlib"), read.topology.numValidFaces(), edges


def trimesh(mesh, degrees, steps):
    import trimesh as library

    steps.done("start")
    # Without `process=False` it also merges vertices.
    read = library.load_mesh(mesh, process=False)
    steps.done("read")
    edges = len(read.face_adjacency_edges[read.face_adjacency_angles > math.radians(degrees)])
    steps.done("edges_found")
    return version("trimesh"), len(read.faces), edges


def version(package):
    import importlib.metadata

    return importlib.metadata.version(package)


PEERS = {peer.__name__: peer for peer in (vtk, igl, meshlib, trimesh)}


def main():
    name, mesh, degrees = sys.argv[1:]
    steps = Steps()
    found = dict(zip(("version", "faces", "edges"), PEERS[name](mesh, float(degrees), steps)))
    print(json.dumps(found | steps.taken))


if __name__ == "__main__":
    main()
