"""Stage "inputs": read the files, check everything before any work, repair what is safe, keep the meshes as arrays."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolkit.checks import (
    check_feature_lines,
    check_inputs,
    check_mesh,
    check_pair,
    check_sequence,
    log_findings,
    raise_for,
)
from toolkit.checks.edges import edge_table
from toolkit.checks.inputs import Places
from toolkit.checks.seams import check_source_seams
from toolkit.feature_lines import FeatureLine, load_feature_lines, save_feature_lines, trace_lines
from toolkit.mesh import Polygons, TriangleMesh
from toolkit.meshio import FrameSequence, cache_as_npy, open_sequence, read_mesh
from toolkit.progress import Progress
from toolkit.registration.landmarks import Landmarks, load_landmarks
from toolkit.shot import Shot, StageFolder

__all__ = ["files", "load_landmark_pairs", "load_lines", "load_mesh", "load_sequence", "work"]

# These are memory-mapped as they are; other formats are copied to an .npy once.
_MAPPED = (".npy", ".pc2")


def files(shot: Shot) -> dict[str, Path]:
    """Every file that the stage reads, by what it is."""
    config = shot.config
    found = {
        "source reference": config.source.reference,
        "frames": config.source.frames,
        "target reference": config.target.reference,
    }
    if shot.landmarks_path.exists():
        found["landmarks"] = shot.landmarks_path
    if shot.feature_lines_path.exists():
        found["feature lines"] = shot.feature_lines_path
    return found


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Read, check, repair and store the inputs."""
    config = shot.config
    source, target = read_mesh(config.source.reference), read_mesh(config.target.reference)
    sequence = open_sequence(config.source.frames, fps=config.source.fps)
    landmarks = load_landmarks(shot.landmarks_path) if shot.landmarks_path.exists() else Landmarks.none()
    same = same_topology(source, target)
    lines: list[FeatureLine] = []
    if shot.feature_lines_path.exists():
        lines = load_feature_lines(shot.feature_lines_path, source.n_vertices, target.n_vertices)
    places = Places(
        str(config.source.reference),
        str(config.target.reference),
        str(shot.landmarks_path),
        str(shot.feature_lines_path),
    )
    if not same or len(landmarks.names):
        checked = check_inputs(
            source,
            sequence,
            target,
            names=landmarks.names,
            source_ids=landmarks.source,
            target_ids=landmarks.target,
            lines=lines,
            places=places,
            progress=progress,
        )
        source, target, lines = checked.source, checked.target, list(checked.lines)
        landmarks = Landmarks(landmarks.source, checked.target_ids, landmarks.names)
        folder.numbers["findings"] = [f.sentence for f in checked.findings] + list(checked.notes)
    else:
        _check_without_landmarks(source, target, sequence, lines, places, progress)
    _save_mesh(folder, "source", source)
    _save_mesh(folder, "target", target)
    folder.save("landmarks", np.stack([landmarks.source, landmarks.target], axis=1))
    (folder.path / "landmark_names.json").write_text(json.dumps(list(landmarks.names)), encoding="utf-8")
    save_feature_lines(folder.path / "lines.json", trace_lines(lines, source.vertices, source.triangles))
    if config.source.frames.suffix.lower() not in _MAPPED:
        cache_as_npy(sequence, folder.path / "frames.npy", progress)
    folder.numbers |= {
        "vertices": source.n_vertices,
        "triangles": source.n_triangles,
        "frames": sequence.n_frames,
        "fps": sequence.fps,
        "target_vertices": target.n_vertices,
        "target_triangles": target.n_triangles,
        "landmarks": len(landmarks.names),
        "feature_lines": len(lines),
        "parts": int(edge_table(source.triangles, source.n_vertices).parts.max()) + 1,
        "same_topology": same,
    }


def _check_without_landmarks(
    source: TriangleMesh,
    target: TriangleMesh,
    sequence: FrameSequence,
    lines: list[FeatureLine],
    places: Places,
    progress: Progress,
) -> None:
    """The checks of a target that is on the source's topology already; its vertices stay as they are."""
    for findings in (
        check_mesh(source, places.source) + check_mesh(target, places.target),
        check_pair(source, sequence, places.source),
        [replace(finding, severity="warning") for finding in check_source_seams(source, sequence, places.source)],
        check_feature_lines(lines, source, places.feature_lines),
        check_sequence(sequence, source, progress=progress),
    ):
        raise_for(findings)
        log_findings(findings)


def same_topology(source: TriangleMesh, target: TriangleMesh) -> bool:
    """Whether the target is on the source's topology already, so that no registration is needed."""
    return source.n_vertices == target.n_vertices and np.array_equal(source.triangles, target.triangles)


def load_mesh(shot: Shot, side: str) -> TriangleMesh:
    """The checked ``"source"`` or ``"target"`` reference."""
    polygons = None
    if (shot.stage_folder("inputs") / f"{side}_polygon_counts.npy").exists():
        counts = np.array(shot.array("inputs", f"{side}_polygon_counts"))
        polygons = Polygons(counts, np.array(shot.array("inputs", f"{side}_polygon_indices")))
    vertices = np.array(shot.array("inputs", f"{side}_vertices"))
    return TriangleMesh(vertices, np.array(shot.array("inputs", f"{side}_triangles")), polygons)


def load_sequence(shot: Shot) -> FrameSequence:
    """The performance, memory-mapped."""
    cached = shot.stage_folder("inputs") / "frames.npy"
    path = cached if cached.exists() else shot.config.source.frames
    numbers = (shot.manifest("inputs") or {}).get("numbers", {})
    return open_sequence(path, fps=shot.config.source.fps or numbers.get("fps"))


def load_lines(shot: Shot) -> list[FeatureLine]:
    """The feature lines as edge paths."""
    return load_feature_lines(shot.stage_folder("inputs") / "lines.json")


def load_landmark_pairs(shot: Shot) -> Landmarks:
    """The landmarks, target ids being those of the repaired target."""
    names = json.loads((shot.stage_folder("inputs") / "landmark_names.json").read_text(encoding="utf-8"))
    pairs = np.array(shot.array("inputs", "landmarks"), dtype=np.int64).reshape(-1, 2)
    return Landmarks.of(pairs[:, 0], pairs[:, 1], names)


def _save_mesh(folder: StageFolder, side: str, mesh: TriangleMesh) -> None:
    folder.save(f"{side}_vertices", mesh.vertices)
    folder.save(f"{side}_triangles", mesh.triangles)
    if mesh.polygons is not None:
        folder.save(f"{side}_polygon_counts", mesh.polygons.counts)
        folder.save(f"{side}_polygon_indices", mesh.polygons.indices)
