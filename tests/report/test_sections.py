from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from toolkit.quality import detail_energy
from toolkit.rendering.takes import View
from toolkit.report import ReportData, build, sections
from toolkit.report.data import Figure
from toolkit.report.pictures import bases_figures, coating_figures, motion_figures, registration_figures
from toolkit.smoothing import SmoothingFilter, SmoothingParameters


@pytest.fixture(scope="module")
def ball() -> View:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=3)
    vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32)
    return View("ball", triangles, vertices, 5, lambda t: vertices * [1, 1 + 0.1 * t, 1])


def _grey(image: np.ndarray) -> np.ndarray:
    return np.ptp(image.astype(int), axis=2) < 12


def test_registration_pictures_show_distance_and_leave_the_interior_grey(ball):
    distance = np.linspace(0, 1, len(ball.rest))
    original = (ball.rest[:4] * 2, np.array([[0, 1, 2]]))
    interior = np.ones(len(ball.rest), dtype=bool)
    given, _, grey, _ = registration_figures(ball, distance, "mm", original=original, interior=interior)
    assert given.image.shape == (600, 480, 3)
    _, colourful, _ = registration_figures(ball, distance, "mm")
    assert _grey(grey.image[250:350, 200:280]).all()
    assert _grey(colourful.image[250:350, 200:280]).mean() < 0.1
    assert grey.image.shape[0] > 600  # the legend


def test_coating_pictures_are_four_and_the_smooth_one_differs(ball):
    rng = np.random.default_rng(0)
    rough = View("rough", ball.triangles, ball.rest, 1, lambda t: ball.rest * (1 + 0.05 * rng.random((642, 1))))
    figures = coating_figures(rough, 0, SmoothingFilter(ball.triangles, len(ball.rest), SmoothingParameters()), "cm")
    assert len(figures) == 4
    captured, smooth = (figure.image[200:400, 150:330].astype(float) for figure in figures[:2])
    roughness = [np.abs(np.diff(picture, n=2, axis=1)).mean() for picture in (captured, smooth)]
    assert roughness[0] > 1.3 * roughness[1]


def test_every_view_has_its_motion_and_every_basis_its_faces(ball):
    assert len(motion_figures([ball, ball], 4, [2.0, 2.0])) == 2
    bases = np.stack([ball.frame(t) for t in range(1, 5)])
    figures = bases_figures([(ball, bases), (ball, bases)], np.arange(1, 5), limit=3, width=40)
    assert [figure.caption for figure in figures] == ["Basis 1: frame 1", "Basis 2: frame 2", "Basis 3: frame 3"]
    assert figures[0].image.shape == (100, 40, 3)


def test_detail_energy_is_the_rms_length():
    details = np.zeros((3, 4, 3), np.float32)
    details[1, :, 0] = 2
    details[2, 0] = (3, 4, 0)
    assert detail_energy(details) == pytest.approx([0, 2, 2.5])
    assert detail_energy(details, np.array([2.0, 0, 0, 0])) == pytest.approx([0, 2, 5])


@pytest.mark.parametrize("count", [1, 3, 20])
def test_all_sections_make_one_page(count):
    weights = np.abs(np.random.default_rng(1).normal(size=(30, count)))
    page = build(
        ReportData(
            "t",
            sections=[
                sections.performance_section([]),
                sections.registration_section([], {"flips": 0}),
                sections.decomposition_section([], {}),
                sections.bases_section([], weights, 1 / np.arange(1, count + 2), "cm", {}),
                sections.transfer_section([], {"lips": {"source": np.zeros(30), "result": np.ones(30)}}, {}),
                sections.details_section(np.ones(30), np.ones(30), "cm", {}),
                sections.timings_section({"register": 1.25, "bases": 2.5}),
            ],
        )
    )
    assert page.count("</i>basis") == (count if 1 < count <= 6 else 0)
    assert re.search(r"<td>Total \(s\)</td><td[^>]*>3.75</td>", page.replace("\n", ""))
    assert page.count("<section") == 7


def test_the_close_up_holds_the_whole_of_a_face_with_a_snout(ball):
    # What lies in front is seen larger: a snout pushes the chin out of a picture that is zoomed to the middle.
    x, y, z = ball.rest.T
    face = replace(ball, rest=np.stack([x, y, z + 3 * np.maximum(z, 0) * np.maximum(-y, 0)], axis=1))
    only, everything = np.flatnonzero((np.abs(x) < 0.1) & (np.abs(y) < 0.1)), np.arange(len(ball.rest))
    near = registration_figures(face, np.ones(len(x)), "mm", only=only)[-1]
    whole = registration_figures(face, np.ones(len(x)), "mm", only=only, close_up=everything)[-1]

    def at_its_rim(figure: Figure) -> np.ndarray:
        return np.concatenate([figure.image[[0, -1]].reshape(-1, 3), figure.image[:, [0, -1]].reshape(-1, 3)])

    empty = at_its_rim(whole).max()
    assert (whole.image > empty).any(axis=2).mean() > 0.1
    assert (at_its_rim(near) > empty).any()
