"""Stage "register": the target's shape on the source's topology."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.progress import Progress
from toolkit.registration import register
from toolkit.rigid import Similarity, umeyama
from toolkit.shot import Shot, StageFolder
from toolkit.stages.inputs import load_landmark_pairs, load_lines, load_mesh, same_topology

__all__ = ["load_pose", "load_target", "work"]


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Register, unless the target is on the source's topology already."""
    source, target = load_mesh(shot, "source"), load_mesh(shot, "target")
    landmarks = load_landmark_pairs(shot)
    if same_topology(source, target):
        vertices, distance = target.vertices, np.zeros(source.n_vertices)
        interior = np.zeros(source.n_vertices, dtype=bool)
        flipped, wrong_sheet = np.zeros(source.n_triangles, dtype=bool), interior
        folder.numbers["method"] = "none: the target is on the source's topology"
    elif not len(landmarks.names):
        raise InputError(
            "there are no landmarks, and the target has another topology than the source",
            where=shot.landmarks_path,
            remedy="pick 30 to 50 pairs in the viewer, or give --landmarks to scripts/new_shot.py",
        )
    else:
        result = register(source, target, landmarks, load_lines(shot), shot.config.register, progress)
        vertices, distance, interior = result.vertices, result.distance, result.interior
        flipped, wrong_sheet = result.flipped, result.wrong_sheet
        folder.numbers |= asdict(result.quality) | {"warnings": list(result.warnings)}
    folder.save("target_vertices", vertices)
    folder.save("distance", distance)
    folder.save("interior", interior)
    folder.save("flipped", flipped)
    folder.save("wrong_sheet", wrong_sheet)
    skin = ~interior
    pose = umeyama(source.vertices[skin], vertices[skin])
    folder.save("pose", np.concatenate([[pose.scale], pose.rotation.ravel(), pose.translation]))
    folder.numbers["size_ratio"] = pose.scale


def load_pose(shot: Shot) -> Similarity:
    """The similarity from the source's pose and size to the target's place."""
    packed = np.array(shot.array("register", "pose"))
    return Similarity(float(packed[0]), packed[1:10].reshape(3, 3), packed[10:13])


def load_target(shot: Shot) -> TriangleMesh:
    """``T_0`` on the source's topology, brought to the source's pose and size: all later stages work there."""
    source = load_mesh(shot, "source")
    return source.with_vertices(load_pose(shot).inverse().apply(shot.array("register", "target_vertices")))
