import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from toolkit.errors import InputError
from toolkit.meshio import open_sequence, read_mesh

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
FACES = np.array([[0, 1, 2], [0, 3, 1]], dtype=np.uint16)
CODES = {"f4": 5126, "u1": 5121, "i1": 5120, "u2": 5123, "i2": 5122, "u4": 5125}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Document:
    """A glTF document under construction."""

    def __init__(self, **sections):
        self.binary = b""
        self.json = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], **sections}

    def view(self, data, **extra):
        self.binary += b"\0" * (-len(self.binary) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **extra})
        self.binary += data
        return len(self.json["bufferViews"]) - 1

    def add(self, values, **extra):
        values = np.asarray(values)
        width = values.shape[1] if values.ndim == 2 else 1
        accessor = {"componentType": CODES[values.dtype.str[1:]], "count": len(values), "type": KINDS[width]}
        self.json["accessors"].append({"bufferView": self.view(values.tobytes()), **accessor, **extra})
        return len(self.json["accessors"]) - 1

    def save(self, path, buffer=None):
        uri = {} if path.suffix == ".glb" else {"uri": buffer}
        self.json["buffers"] = [{"byteLength": len(self.binary), **uri}]
        text = json.dumps(self.json).encode()
        if path.suffix == ".glb":
            text += b" " * (-len(text) % 4)
            binary = self.binary + b"\0" * (-len(self.binary) % 4)
            chunks = (
                struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
            )
            text = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
        path.write_bytes(text)
        return path


def plain(**sections):
    doc = Document(nodes=[{"mesh": 0}], **sections)
    primitive = {"attributes": {"POSITION": doc.add(POINTS)}, "indices": doc.add(FACES.ravel())}
    doc.json["meshes"] = [{"primitives": [primitive]}]
    return doc


def animated(times, values, path="weights", interpolation="LINEAR"):
    """Two morph targets, or a node motion, with one channel."""
    doc = plain()
    targets = [{"POSITION": doc.add(POINTS + 1)}, {"POSITION": doc.add(POINTS[::-1].copy())}]
    doc.json["meshes"][0]["primitives"][0]["targets"] = targets
    times, values = np.asarray(times, dtype=np.float32), np.asarray(values, dtype=np.float32)
    sampler = {"input": doc.add(times), "output": doc.add(values), "interpolation": interpolation}
    doc.json["animations"] = [
        {"samplers": [sampler], "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}]}
    ]
    return doc


@pytest.mark.parametrize("kind", ["glb", "data", "file"])
def test_containers(tmp_path, kind):
    doc = plain()
    if kind == "glb":
        path = doc.save(tmp_path / "a.glb")
    elif kind == "data":
        uri = "data:application/octet-stream;base64," + base64.b64encode(doc.binary).decode()
        path = doc.save(tmp_path / "a.gltf", uri)
    else:
        path = doc.save(tmp_path / "a.gltf", "the%20data.bin")
        with pytest.raises(InputError, match=r"its buffer the%20data\.bin is missing"):
            read_mesh(path)
        (tmp_path / "the data.bin").write_bytes(doc.binary)
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, POINTS)
    np.testing.assert_array_equal(mesh.triangles, FACES)


def nested():
    doc = plain()
    turn = Rotation.from_euler("xyz", [20, 40, 60], degrees=True)
    matrix = np.eye(4)
    matrix[:3] = np.c_[Rotation.from_rotvec([0, 0, 1]).as_matrix(), [5, 6, 7]]
    doc.json["nodes"] = [
        {"children": [1, 2], "rotation": turn.as_quat().tolist(), "translation": [1, 2, 3], "scale": [1, 2, 3]},
        {"mesh": 0, "matrix": matrix.T.ravel().tolist()},
        {"children": [3], "scale": [-1, 1, 1]},
        {"mesh": 0, "translation": [0, 0, 9]},
        {"mesh": 0, "name": "not in the scene"},
    ]
    doc.json["scenes"] = [{"nodes": []}, {"nodes": [0]}]
    doc.json["scene"] = 1
    return doc


def test_nodes_are_joined_with_their_transforms(tmp_path):
    path = nested().save(tmp_path / "a.glb")
    mesh = read_mesh(path)
    assert (mesh.n_vertices, mesh.n_triangles) == (8, 4)
    theirs = trimesh.load(path, process=False)
    expected = np.concatenate(
        [
            trimesh.transform_points(theirs.geometry[theirs.graph[n][1]].vertices, theirs.graph[n][0])
            for n in theirs.graph.nodes_geometry
        ]
    )
    np.testing.assert_allclose(np.sort(mesh.vertices, axis=0), np.sort(expected, axis=0), atol=1e-6)
    np.testing.assert_array_equal(mesh.triangles[:2], FACES)
    np.testing.assert_array_equal(mesh.triangles[2:], FACES[:, ::-1] + 4)  # mirrored, so the winding turns


def test_primitives_that_share_vertices_do_not_repeat_them(tmp_path):
    doc = plain()
    first = doc.json["meshes"][0]["primitives"][0]
    second = {"attributes": first["attributes"], "indices": doc.add(np.array([1, 2, 3], dtype=np.uint8))}
    own = {"attributes": {"POSITION": doc.add(POINTS[:3] + 5)}}  # without indices
    lines = {"attributes": {"POSITION": doc.add(POINTS)}, "mode": 1}
    doc.json["meshes"][0]["primitives"] += [own, second, lines]
    mesh = read_mesh(doc.save(tmp_path / "a.glb"))
    np.testing.assert_array_equal(mesh.vertices, np.concatenate([POINTS, POINTS[:3] + 5]))
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 3, 1], [1, 2, 3], [4, 5, 6]])


def test_strips_and_fans(tmp_path):
    doc = plain()
    primitive = doc.json["meshes"][0]["primitives"][0]
    primitive["indices"] = doc.add(np.array([0, 1, 2, 3], dtype=np.uint8))
    primitive["mode"] = 5
    np.testing.assert_array_equal(read_mesh(doc.save(tmp_path / "a.glb")).triangles, [[0, 1, 2], [1, 3, 2]])
    primitive["mode"] = 6
    np.testing.assert_array_equal(read_mesh(doc.save(tmp_path / "a.glb")).triangles, [[1, 2, 0], [2, 3, 0]])


def test_sparse_strided_normalised_and_empty_accessors(tmp_path):
    doc = plain()
    position = doc.json["meshes"][0]["primitives"][0]["attributes"]
    rows, values = np.array([1, 3], dtype=np.uint8), POINTS[:2] + 8
    sparse = {"count": 2, "indices": {"bufferView": doc.view(rows.tobytes()), "componentType": 5121}}
    sparse["values"] = {"bufferView": doc.view(values.tobytes())}
    doc.json["accessors"].append({"componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse})
    position["POSITION"] = len(doc.json["accessors"]) - 1
    expected = np.zeros((4, 3))
    expected[[1, 3]] = values
    np.testing.assert_array_equal(read_mesh(doc.save(tmp_path / "a.glb")).vertices, expected)

    packed = np.zeros((4, 5), dtype="<i2")  # one blank before the position, one after
    packed[:, 1:4] = [[32767, 0, 0], [0, -32767, 0], [-32768, 0, 0], [0, 0, 16384]]
    accessor = {"bufferView": doc.view(packed.tobytes(), byteStride=10), "byteOffset": 2, "componentType": 5122}
    doc.json["accessors"].append({**accessor, "count": 4, "type": "VEC3", "normalized": True})
    position["POSITION"] = len(doc.json["accessors"]) - 1
    expected = [[1, 0, 0], [0, -1, 0], [-1, 0, 0], [0, 0, 16384 / 32767]]
    np.testing.assert_allclose(read_mesh(doc.save(tmp_path / "a.glb")).vertices, expected, atol=1e-7)


def test_default_weights_and_weight_animation(tmp_path):
    doc = animated([0, 0.5, 1.0], np.array([0, 0, 1, 0, 0.25, 0.5]))
    doc.json["meshes"][0]["weights"] = [0.5, 0.0]
    path = doc.save(tmp_path / "a.glb")
    np.testing.assert_allclose(read_mesh(path).vertices, POINTS + 0.5 * (POINTS + 1), atol=1e-7)
    sequence = open_sequence(path, fps=4)
    weights = np.array([[0, 0], [0.5, 0], [1, 0], [0.625, 0.25], [0.25, 0.5]])
    expected = POINTS + np.einsum("tk,kvc->tvc", weights, np.stack([POINTS + 1, POINTS[::-1]]))
    np.testing.assert_allclose(sequence.read(0, 5), expected, atol=1e-6)
    assert sequence.n_frames == 5
    assert open_sequence(path).fps == 2
    assert open_sequence(path).n_frames == 3


@pytest.mark.parametrize(
    ("times", "fps", "n_frames"),
    [
        (np.arange(40) / 24, 24, 40),
        (np.arange(1000) / 29.97 + 3, 29.97, 1000),
        (np.array([0, 1, 2, 7, 8]) / 30, 30, 9),  # keys left out by the writer
        ([0, 0.013, 0.4, 1.0], 30, 31),  # on no grid
        ([0, 1.0], 30, 31),
        ([2.0], 30, 1),
    ],
)
def test_the_frame_rate_is_the_one_the_keys_lie_on(tmp_path, times, fps, n_frames):
    sequence = open_sequence(animated(times, np.zeros(2 * len(times))).save(tmp_path / "a.glb"))
    assert (sequence.fps, sequence.n_frames) == (pytest.approx(fps, abs=1e-3), n_frames)


def test_step_and_cubic_spline(tmp_path):
    path = animated([0, 1], np.array([0, 0, 1, 0]), interpolation="STEP").save(tmp_path / "a.glb")
    frames = open_sequence(path, fps=2).read(0, 3)
    np.testing.assert_array_equal(frames[0], frames[1])
    np.testing.assert_array_equal(frames[2], 2 * POINTS + 1)
    # A cubic spline with tangents of x(t) = t^3 on both keys reproduces it.
    values = np.array([[[0, 0], [0, 0], [0, 0]], [[3, 0], [1, 0], [3, 0]]])
    path = animated([0, 1], values.ravel(), interpolation="CUBICSPLINE").save(tmp_path / "b.glb")
    frames = open_sequence(path, fps=10).read(0, 11)
    expected = POINTS + (np.linspace(0, 1, 11) ** 3)[:, None, None] * (POINTS + 1)
    np.testing.assert_allclose(frames, expected, atol=1e-6)


def test_node_rotation_turns_the_short_way(tmp_path):
    turns = Rotation.from_rotvec([[0, 0, 0], [0, 0, 1.0]]).as_quat()
    turns[1] *= -1
    frames = open_sequence(animated([0, 1], turns, "rotation").save(tmp_path / "a.glb"), fps=4).read(0, 5)
    expected = [Rotation.from_rotvec([0, 0, a]).apply(POINTS) for a in np.linspace(0, 1, 5)]
    np.testing.assert_allclose(frames, expected, atol=1e-6)


def test_a_parent_and_a_skin_move_vertices(tmp_path):
    doc = animated([0, 1], np.array([[0, 0, 0], [2, 0, 0]]), "translation")
    doc.json["nodes"] = [{"children": [1]}, {"mesh": 0}]
    frames = open_sequence(doc.save(tmp_path / "a.glb"), fps=1).read(0, 2)
    np.testing.assert_allclose(frames[1], POINTS + [2, 0, 0])

    # Two joints, of which the animation moves the first; the bind pose is theirs at rest.
    doc.json["nodes"] = [
        {"translation": [0, 0, 0]},
        {"translation": [0, 3, 0]},
        {"mesh": 0, "skin": 0, "scale": [9, 9, 9]},
    ]
    bind = np.stack([np.eye(4), np.eye(4)]).astype(np.float32)
    bind[1, 3, :3] = [0, -3, 0]  # stored column by column
    doc.json["skins"] = [{"joints": [0, 1], "inverseBindMatrices": doc.add(bind.reshape(2, 16))}]
    attributes = doc.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = doc.add(np.tile(np.array([0, 1, 0, 0], dtype=np.uint8), (4, 1)))
    share = np.array([1, 0.5, 0.25, 0], dtype=np.float32)
    attributes["WEIGHTS_0"] = doc.add(np.stack([share, 1 - share, 0 * share, 0 * share], axis=1))
    path = doc.save(tmp_path / "b.glb")
    np.testing.assert_allclose(read_mesh(path).vertices, POINTS, atol=1e-7)
    frames = open_sequence(path, fps=1).read(0, 2)
    np.testing.assert_allclose(frames[1], POINTS + share[:, None] * [2, 0, 0], atol=1e-6)


def test_the_animation_that_moves_the_mesh_is_taken(tmp_path):
    doc = animated([0, 1], np.array([0, 0, 1, 0]))
    doc.json["nodes"].append({"name": "camera"})
    other = {"sampler": 0, "target": {"node": 1, "path": "translation"}}
    doc.json["animations"].insert(0, {"samplers": doc.json["animations"][0]["samplers"], "channels": [other]})
    assert open_sequence(doc.save(tmp_path / "a.glb"), fps=1).n_frames == 2
    doc.json["animations"].pop()
    with pytest.raises(InputError, match="none of its 1 animations moves a mesh; export it with its animation"):
        open_sequence(doc.save(tmp_path / "a.glb"))
    with pytest.raises(InputError, match="none of its 0 animations"):
        open_sequence(plain().save(tmp_path / "a.glb"))


def broken(change):
    doc = plain()
    change(doc.json)
    return doc


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["accessors"][0].update(count=500), "accessor 0 cannot be read .*beyond"),
        (lambda d: d["accessors"][0].update(componentType=1), "accessor 0 cannot be read"),
        (lambda d: d["nodes"][0].update(mesh=7), "does not hold together"),
        (lambda d: d["meshes"][0]["primitives"].clear(), "no vertices"),
        (lambda d: d["accessors"][0].update(count=2), "uses vertex .* but there are 2 vertices"),
        (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "compressed .* without compression"),
    ],
)
def test_broken_documents_are_refused(tmp_path, change, said):
    with pytest.raises(InputError, match=said):
        read_mesh(broken(change).save(tmp_path / "a.glb"))


def test_a_broken_animation_is_refused(tmp_path):
    doc = animated([0, 1], np.zeros(4))
    doc.json["animations"][0]["channels"][0]["sampler"] = 3
    with pytest.raises(InputError, match="does not hold together"):
        open_sequence(doc.save(tmp_path / "a.glb"))
    doc = animated([0, 1], np.zeros(3))
    with pytest.raises(InputError, match="2 times for 3 values"):
        open_sequence(doc.save(tmp_path / "a.glb"))


def test_broken_files_are_refused(tmp_path):
    path = plain().save(tmp_path / "a.glb")
    data = path.read_bytes()
    path.write_bytes(data[:-4])
    with pytest.raises(InputError, match=rf"says {len(data)} bytes, but the file has {len(data) - 4}"):
        read_mesh(path)
    path.write_bytes(data[:15])
    with pytest.raises(InputError, match="has 15 bytes"):
        read_mesh(path)
    path.write_bytes(data[:4] + b"\1\0\0\0" + data[8:])
    with pytest.raises(InputError, match="glTF version 1"):
        read_mesh(path)
    path.write_bytes(b"hello")
    with pytest.raises(InputError, match="is not a glTF file"):
        read_mesh(path)
