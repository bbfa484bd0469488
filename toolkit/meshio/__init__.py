"""Order-preserving readers and writers of meshes and takes.

`read_mesh` and `write_mesh` for one mesh, `open_sequence` for a performance. Vertices keep the file's order and unit;
faces keep their order and their polygons. Libraries that one format needs are imported when that format is read.
"""

from toolkit.meshio.formats import MESH_SUFFIXES, SEQUENCE_SUFFIXES, open_sequence, read_mesh, write_mesh
from toolkit.meshio.sequence import FrameSequence, cache_as_npy

__all__ = [
    "MESH_SUFFIXES",
    "SEQUENCE_SUFFIXES",
    "FrameSequence",
    "cache_as_npy",
    "open_sequence",
    "read_mesh",
    "write_mesh",
]
