from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree

from data.guides import guide_stops
from data.heads import SHAPES, build_head
from data.layout import LEVELS, hand_made
from data.remeshing import closest_on_surface, split_quads
from data.targets import build_target
from toolkit.feature_lines import load_feature_lines
from toolkit.mesh import connected_components, triangle_areas, unique_edges, vertex_normals


def read_ply(path):
    """A literal reader of the one kind of PLY that the samples write."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    counts = [int(line.split()[2]) for line in header.decode().splitlines() if line.startswith("element")]
    vertices = np.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3).astype(float)
    faces = np.frombuffer(body, [("n", "u1"), ("v", "<i4", (3,))], counts[1], offset=12 * counts[0])
    assert (faces["n"] == 3).all()
    return vertices, faces["v"]


@pytest.mark.parametrize("name", ["asian_female", "hound"])
def test_the_truth_lies_on_the_remeshed_surface(coarse, layout, name):
    vertices, triangles = read_ply(coarse.targets[name].reference)
    places = coarse.truth(name).shape(np.zeros(52))
    size, centre = np.ptp(vertices, axis=0).max(), vertices.mean(0)
    nearest = closest_on_surface((places - centre) / size, (vertices - centre) / size, triangles) @ vertices
    distance = np.linalg.norm(nearest - places, axis=1) / size

    face = np.zeros(len(places), dtype=bool)
    face[layout.skin_quads(0)] = True
    for loop in ("ear_helix_left", "ear_helix_right", "nostril_rim_left", "nostril_rim_right"):
        # Folds finer than the coarsest triangles.
        around = places[layout.loops[loop]]
        radius = np.linalg.norm(around - around.mean(0), axis=1).max()
        face &= np.linalg.norm(places - around.mean(0), axis=1) > 1.3 * radius
    assert np.median(distance[face]) < 5e-4
    assert np.percentile(distance[face], 99) < 6e-3
    rims = np.concatenate([layout.arcs[name] for name in layout.arcs])
    assert np.percentile(distance[rims], 95) < 1e-3


@pytest.mark.parametrize("blink", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("name", ["asian_female", "hound"])
def test_the_lids_folds_are_not_cut_across(coarse, layout, name, blink):
    """The margins of the lids and the fold above them are finer than a skull's triangles, open, half shut and shut."""
    truth, weights = coarse.truth(name), np.zeros(52)
    weights[[SHAPES.index("eyeBlinkLeft"), SHAPES.index("eyeBlinkRight")]] = blink
    surface = layout.subdivision.matrix @ truth.control(weights)
    vertices, (_, triangles) = truth.own_shape(weights), read_ply(coarse.targets[name].reference)
    size = np.ptp(vertices, axis=0).max()
    surface_normals = vertex_normals(surface, split_quads(layout.quads(LEVELS)))
    normals = vertex_normals(vertices, triangles)
    for side in ("left", "right"):
        rings, rim = layout.rings[f"eye_{side}"], set(layout.loops[f"eyelid_rim_{side}"])
        at_rim = next(k for k, ring in enumerate(rings) if set(ring) == rim)
        for ring in rings[at_rim - 3 : at_rim]:
            line = layout.subdivision.refine_path([*ring, ring[0]], LEVELS)
            places = closest_on_surface(surface[line] / size, vertices / size, triangles)
            # 0.25 mm on a head of 25 cm: the coarsest triangles are 2 mm wide here.
            assert np.sqrt(np.mean(np.sum((places @ vertices - surface[line]) ** 2, axis=1))) < 1e-3 * size
            shaded = places @ normals
            cosine = np.sum(shaded * surface_normals[line], axis=1) / np.linalg.norm(shaded, axis=1)
            assert np.median(cosine) > np.cos(np.radians(16))


@pytest.mark.parametrize("name", ["asian_female", "hound"])
def test_the_target_is_one_clean_sheet_in_its_own_order(coarse, name):
    vertices, triangles = read_ply(coarse.targets[name].reference)
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len(np.unique(directed, axis=0)) == len(directed), "an edge is used twice in the same direction"
    assert connected_components(triangles, len(vertices))[0] == 1
    assert triangle_areas(vertices, triangles).min() > 0
    assert len(vertices) != 4326


def test_the_target_file_is_its_own_truth_at_rest(coarse):
    for name in coarse.targets:
        vertices, _ = read_ply(coarse.targets[name].reference)
        np.testing.assert_allclose(coarse.truth(name).own_shape(np.zeros(52)), vertices, rtol=1e-6)


def test_the_truth_of_an_expression_is_the_heads_own(coarse, package, layout):
    weights = np.zeros(52)
    weights[[SHAPES.index("jawOpen"), SHAPES.index("mouthSmileLeft")]] = 0.5, 0.8
    head = build_head(package, "hound")
    expected = layout.subdivision.matrix[:4326] @ head.shape(weights)
    x, y, z = expected.T
    np.testing.assert_allclose(
        coarse.truth("hound").shape(weights), np.stack([10 * x, -10 * z, 10 * y + 1500], axis=1), atol=1e-4
    )


def test_landmarks_and_lines_name_the_same_places_on_both_faces(coarse):
    for name, paths in coarse.targets.items():
        vertices, triangles = read_ply(paths.reference)
        truth = coarse.truth(name).shape(np.zeros(52))
        size = np.ptp(vertices, axis=0).max()
        for file, count in ((paths.landmarks, 45), (paths.landmarks_30, 30)):
            pairs = json.loads(file.read_text())["pairs"]
            assert len({pair["target"] for pair in pairs}) == count
            source, target = (np.array([pair[side] for pair in pairs]) for side in ("source", "target"))
            assert np.linalg.norm(vertices[target] - truth[source], axis=1).max() < 0.03 * size
        # Ears and skull are coarse at this level: their nearest vertex is what can be picked, wherever it is.
        head = json.loads(paths.landmarks_head.read_text())["pairs"]
        assert len({pair["target"] for pair in head}) == 55
        assert head[:45] == json.loads(paths.landmarks.read_text())["pairs"]
        edges = {tuple(edge) for edge in unique_edges(triangles).tolist()}
        lines = [line for line in json.loads(paths.feature_lines.read_text())["lines"] if not line.get("guide")]
        assert len(lines) == 12
        for line in lines:
            path = line["target_vertices"] + ([line["target_vertices"][0]] if line["closed"] else [])
            assert all((min(pair), max(pair)) in edges for pair in pairwise(path)), line["name"]
            ends = vertices[path[0]] - truth[line["vertices"][0]]
            assert np.linalg.norm(ends) < 2e-3 * size


def test_guides_are_picked_where_they_truly_lie_and_the_midline_once(coarse, layout):
    stops = guide_stops(layout, 0)
    given = {guide for kind in hand_made("guides").values() for guide in kind}
    assert len(stops) == 2 * len(given) - 2
    assert {"midline_upper", "midline_lower", "jaw_l", "jaw_r", "lid_crease_l", "lid_fold_r"} <= set(stops)
    for name, paths in coarse.targets.items():
        (vertices, _), truth = read_ply(paths.reference), coarse.truth(name).shape(np.zeros(52))
        guides = [line for line in load_feature_lines(paths.feature_lines) if line.guide]
        assert {guide.name for guide in guides} == set(stops)
        near = cKDTree(vertices)
        for guide in guides:
            assert guide.vertices[[0, -1]].tolist() == [stops[guide.name][0], stops[guide.name][-1]]
            picked = guide.target_vertices.tolist()
            assert len(set(picked)) == len(picked)
            # Each pick is the vertex nearest to some point of the true line, and the picks run along it.
            along = near.query(truth[guide.vertices])[1].tolist()
            places = [along.index(vertex) for vertex in picked]
            assert places == sorted(places)


def test_folds_of_the_lids_run_beside_the_rims(layout):
    stops = guide_stops(layout, 0)
    for side, word in (("l", "left"), ("r", "right")):
        rim = set(layout.loops[f"eyelid_rim_{word}"])
        for guide in ("lid_crease", "lid_fold"):
            assert not rim & set(stops[f"{guide}_{side}"])
    assert len(guide_stops(layout, 1)["lid_crease_l"]) == 2 * len(stops["lid_crease_l"]) - 1


def test_a_target_has_the_same_bytes_every_time(package, coarse, tmp_path):
    build_target(package, "asian_female", 0, tmp_path)
    for path in sorted(tmp_path.iterdir()):
        assert path.read_bytes() == (coarse.root / "targets" / "asian_female" / path.name).read_bytes(), path.name
