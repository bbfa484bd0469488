"""Triangle meshes: the container, topology, geometry, validation and repair."""

from toolkit.mesh.core import Polygons, TriangleMesh
from toolkit.mesh.geometry import (
    edge_graph,
    face_normals,
    local_frames,
    triangle_areas,
    vertex_areas,
    vertex_normals,
)
from toolkit.mesh.topology import (
    boundary_edges,
    boundary_vertices,
    connected_components,
    unique_edges,
    vertex_adjacency,
)

__all__ = [
    "Polygons",
    "TriangleMesh",
    "boundary_edges",
    "boundary_vertices",
    "connected_components",
    "edge_graph",
    "face_normals",
    "local_frames",
    "triangle_areas",
    "unique_edges",
    "vertex_adjacency",
    "vertex_areas",
    "vertex_normals",
]
