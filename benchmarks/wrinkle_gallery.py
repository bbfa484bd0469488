#!/usr/bin/env python3
"""The picture of wrinkle edits in the README: before, enhanced, removed, pasted, reshaped.

On the sample performer, subdivided once more than the samples are so that wrinkles come out crisp, in two frames of the
scripted take: the brows raised and the smile. What a removal can remove is what the smoothing calls detail; here that
is everything shorter than ``--wavelength``.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.interpolate import CubicSpline

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from data.heads import SHAPES, build_head  # noqa: E402
from data.layout import LEVELS, hand_made, load_layout  # noqa: E402
from data.package import Package, default_cache, ensure_wheel  # noqa: E402
from data.performance import event_peaks, expression_weights  # noqa: E402
from data.performer import PERFORMER, Performer  # noqa: E402
from data.relief import static_relief  # noqa: E402
from data.remeshing import split_quads  # noqa: E402
from data.subdivision import catmull_clark  # noqa: E402
from data.wrinkles import wrinkle_families  # noqa: E402
from toolkit.decomposition import Decomposer  # noqa: E402
from toolkit.detail_edit import (  # noqa: E402
    Curve,
    Dab,
    DetailEdit,
    DetailTake,
    PasteEdit,
    ReshapeEdit,
    ScaleEdit,
    SurfacePoint,
    drawn,
    painted,
    snapped,
    solve_detail_edit,
    within,
)
from toolkit.mesh import TriangleMesh  # noqa: E402
from toolkit.mesh.geometry import local_frames  # noqa: E402
from toolkit.rendering import Camera, Renderer, Row, contact_sheet  # noqa: E402
from toolkit.smoothing import SmoothingParameters  # noqa: E402

Array = NDArray[np.float64]

_FRAMES = ("brow raise", "smile")
_COLUMNS = ("before", "enhanced", "removed", "pasted", "reshaped")
_SIZE = (440, 400)


@dataclass(frozen=True)
class Face:
    """The performer's details in the two frames, what they lie on, and how the wrinkles' chart is read."""

    take: DetailTake
    smooth: Array
    chart: Array

    def frame(self, index: int, edits: list[DetailEdit]) -> Array:
        """A frame with edits, (V, 3)."""
        take, everything = self.take, np.arange(self.take.n_vertices)
        for edit in edits:
            take = take.changed(solve_detail_edit(edit, take))
        details = take.dynamic(index, index, everything)[0] + take.static_at(everything)
        frames = local_frames(self.smooth[index], self.take.mesh.triangles, self.take.neighbour)
        return np.asarray(self.smooth[index] + np.einsum("vij,vj->vi", frames, details))

    def point(self, along: float, up: float) -> SurfacePoint:
        """The point of the skin at a place of the chart, cm."""
        nearest = int(np.argmin(np.sum((self.chart - [along, up]) ** 2, axis=1)))
        return snapped(self.take.surface, self.take.smooth[nearest][None])[0]

    def curve(self, points: list[list[float]]) -> Curve:
        """A smooth curve through places of the chart."""
        knots = np.array(points)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
        smooth = CubicSpline(along, knots)(np.linspace(0, along[-1], 4 * len(points)))
        return drawn(self.take.surface, [self.point(float(x), float(y)) for x, y in smooth])


def main() -> int:
    """Build the face, make the edits, write the picture."""
    options = _parser().parse_args()
    face = build_face(options.wavelength)
    rows = [Row("brows raised", forehead(face)), Row("smile", smile(face))]
    options.out.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(contact_sheet(rows, _COLUMNS)).save(options.out, quality=options.quality, optimize=True)
    print(f"{options.out}: {options.out.stat().st_size / 1000:.0f} kB")
    return 0


def forehead(face: Face) -> list[NDArray[np.uint8]]:
    """Pictures of the raised brows."""
    lines = hand_made("wrinkles")["families"]["forehead"]["lines"]
    brow = painted(face.take.surface, [Dab(face.point(x, 4.5), 3.4, hardness=0.5) for x in (-4.0, -2.0, 0.0, 2.0, 4.0)])
    one = face.curve(lines[0])
    region = within(face.take.surface, one, 0.55, soft=0.2)
    common: dict[str, Any] = {"frame": 0, "window": (0, 0)}
    goal = face.curve([[-5.2, 2.9], [-4.2, 2.2], [-3.0, 2.0], [-1.9, 2.5], [-0.9, 3.3]])
    lowered = face.point(-4.6, -3.6)
    edits: list[list[DetailEdit]] = [
        [],
        [ScaleEdit(region=brow, factor=2.0, **common)],
        [ScaleEdit(region=brow, factor=0.0, **common)],
        [PasteEdit(region=region, start=one.point(len(one) // 2), goal=lowered, rotation=35.0, **common)],
        [ReshapeEdit(region=region, curve=one, goal=goal, **common)],
    ]
    seen = (face.chart[:, 1] > -6) & (np.abs(face.chart[:, 0]) < 8) & (face.chart[:, 1] < 7.5)
    return pictures(face, 0, edits, seen, (-0.2, 0.05, 1.0))


def smile(face: Face) -> list[NDArray[np.uint8]]:
    """Pictures of the smile, from the side of its crow's feet."""
    families = hand_made("wrinkles")["families"]
    crow = [face.curve([[-s, y] for s, y in line]) for line in families["crow"]["lines"]]
    region = within(face.take.surface, crow[0], 0.3, soft=0.3)
    for line in crow[1:]:
        region = region.joined(within(face.take.surface, line, 0.3, soft=0.3))
    fold = face.curve([[-s, y] for s, y in families["smile_fold"]["lines"][0]])
    beside = within(face.take.surface, fold, 1.2, soft=0.6)
    common: dict[str, Any] = {"frame": 1, "window": (1, 1)}
    goal = face.curve([[-2.2, -3.5], [-3.3, -4.2], [-4.4, -5.2], [-5.2, -6.4], [-5.5, -7.8]])
    both = region.joined(beside)
    edits: list[list[DetailEdit]] = [
        [],
        [ScaleEdit(region=both, factor=2.0, **common)],
        [ScaleEdit(region=both, factor=0.0, **common)],
        [
            PasteEdit(
                region=region,
                start=crow[1].point(len(crow[1]) // 2),
                goal=face.point(-6.9, -3.2),
                scale=1.9,  # the cheek's mesh is coarser than that beside the eye
                strength=0.65,
                **common,
            )
        ],
        [ReshapeEdit(region=beside, curve=fold, goal=goal, **common)],
    ]
    seen = (face.chart[:, 0] < -0.5) & (face.chart[:, 0] > -9) & (np.abs(face.chart[:, 1] + 3) < 6)
    return pictures(face, 1, edits, seen, (-0.8, 0.05, 1.0))


def pictures(
    face: Face,
    index: int,
    edits: list[list[DetailEdit]],
    seen: NDArray[np.bool_],
    direction: tuple[float, float, float],
) -> list[NDArray[np.uint8]]:
    """One picture for each list of edits."""
    renderer = Renderer(face.take.mesh.triangles)
    points = face.frame(index, [])
    camera = Camera.facing(points[seen], direction, aspect=_SIZE[0] / _SIZE[1], margin=0.02)
    return [renderer.render(face.frame(index, one), camera, _SIZE, supersample=3) for one in edits]


def build_face(wavelength: float) -> Face:
    """The performer at one more level of subdivision, decomposed."""
    performer = fine_performer()
    rest = performer.frame(np.zeros(len(SHAPES)))
    mesh = TriangleMesh(rest, split_quads(performer.quads))
    decomposer = Decomposer(mesh, SmoothingParameters(wavelength=wavelength))
    weights, peaks = expression_weights(), event_peaks()
    smooth, details = [], []
    for name in _FRAMES:
        shape = performer.frame(weights[peaks[name]])
        smooth.append(np.asarray(decomposer.filter.smooth(shape), dtype=np.float64))
        frames = local_frames(smooth[-1], mesh.triangles, decomposer.rest.neighbour)
        details.append(np.einsum("vji,vj->vi", frames, shape - smooth[-1]) - decomposer.rest.detail)
    chart = hand_made("wrinkles")
    front = np.where(rest[:, 2] > chart["axis_z"], 0.0, 100.0)
    skin = np.full(len(rest), 100.0)
    skin[np.unique(performer.skin)] = 0.0
    along = chart["radius"] * np.arctan2(rest[:, 0], rest[:, 2] - chart["axis_z"]) + front + skin
    rest_shape = decomposer.rest
    take = DetailTake(
        mesh,
        rest_shape.smooth,
        rest_shape.neighbour,
        local_frames(rest_shape.smooth, mesh.triangles, rest_shape.neighbour),
        np.stack(details).astype(np.float32),
        np.ones(len(rest)),
        rest_shape.detail,
    )
    return Face(take, np.stack(smooth), np.column_stack([along, rest[:, 1]]))


def fine_performer() -> Performer:
    """The performer, one round of subdivision finer than the finest sample (275,000 vertices)."""
    package = Package(ensure_wheel(default_cache()))
    layout, head = load_layout(package), build_head(package, PERFORMER)
    coarse = layout.subdivision.quads[LEVELS]
    once = catmull_clark(coarse, layout.subdivision.counts[LEVELS], 1)
    subdivide = (once.matrix @ layout.subdivision.matrix).tocsr()
    rest = subdivide @ head.neutral
    # Compression is broad: it is measured two rounds before, as for the samples' finest level it is one round before.
    measured = split_quads(layout.skin_quads(LEVELS - 1))
    skin = split_quads(once.quads[1][np.repeat(layout.skin, 4 ** (LEVELS + 1))])
    families = wrinkle_families(rest, skin, measured)
    level = layout.subdivision.matrix @ head.neutral
    relief = once.matrix @ static_relief(layout, level, split_quads(layout.skin_quads(LEVELS)), [], LEVELS)
    for family in families:
        relief[family.vertices] += 0.13 * family.carrier
    return Performer(head, subdivide, once.quads[1], skin, relief, families)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "wrinkles.jpg", help="default docs/wrinkles.jpg")
    parser.add_argument("--wavelength", type=float, default=1.8, help="of the smoothing, cm (default %(default)s)")
    parser.add_argument("--quality", type=int, default=85, help="of the JPEG (default %(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
