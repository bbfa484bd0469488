"""Options that say an edit of poses or of wrinkles on the command line, and what they mean."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toolkit.errors import InputError

if TYPE_CHECKING:
    from toolkit.detail_edit import DetailEdit, Region
    from toolkit.editing import EditSession

__all__ = ["add_pose_options", "add_wrinkle_options", "edit_of_file", "frames_range", "pose_of", "wrinkle_of"]

_NUMBERS = ("lambda_b", "lambda_w", "lambda_e", "handle", "reach", "contacts", "smoothness", "tolerance")


class _AtFrame(argparse.Action):
    """Collects the constraints in order, each with the ``--frame`` before it."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        if option_string == "--frame":
            namespace.frame = values
            return
        if getattr(namespace, "frame", None) is None:
            parser.error(f"{option_string} needs a --frame before it")
        namespace.asked = [*(namespace.asked or []), {**values, "frame": namespace.frame}]


def add_pose_options(parser: argparse.ArgumentParser) -> None:
    """Constraints and how they spread."""
    asked = parser.add_argument_group("what is asked, of the face as it is seen, in the target's unit and place")
    asked.add_argument("--frame", type=int, action=_AtFrame, metavar="N", help="the frame of what follows, from 0")
    asked.add_argument(
        "--point", type=_offset, action=_AtFrame, dest="asked", metavar="V=DX,DY,DZ", help="move a vertex by"
    )
    asked.add_argument(
        "--place", type=_place, action=_AtFrame, dest="asked", metavar="V=X,Y,Z", help="move a vertex to"
    )
    asked.add_argument(
        "--distance",
        type=_distance,
        action=_AtFrame,
        dest="asked",
        metavar="A,B=L",
        help="draw two vertices to a distance L, or with A,B=xF to F times their present one",
    )
    asked.add_argument(
        "--fix", action="append", default=[], metavar="IDS", help="vertices that stay: 12,15,20 or a file of ids"
    )
    asked.add_argument(
        "--fix-farther-than",
        metavar="D",
        help="everything farther than D from the points stays; D in the target's unit, or 20%% of the face's diagonal",
    )
    spread = parser.add_argument_group("how it spreads")
    spread.add_argument("--mode", choices=["both", "bases", "weights"], help="what may change (both)")
    spread.add_argument("--window", type=frames_range, metavar="A:B", help="first and last frame that may change (all)")
    for name in _NUMBERS:
        spread.add_argument(f"--{name.replace('_', '-')}", type=float, metavar="X", help=_HELP[name])


def pose_of(options: argparse.Namespace, session: EditSession) -> dict[str, Any] | None:
    """The pose edit as data for the journal; None where nothing is asked."""
    constraints: list[dict[str, Any]] = list(options.asked or [])
    for text in options.fix:
        constraints.append({"kind": "fixed", "vertices": _ids(text)})
    if options.fix_farther_than is not None:
        constraints.append({"kind": "beyond", "distance": _length(options.fix_farther_than, session)})
    if not constraints:
        return None
    parameters = {name: getattr(options, name) for name in ("mode", "window", *_NUMBERS)}
    return {"constraints": constraints, "parameters": {k: v for k, v in parameters.items() if v is not None}}


def add_wrinkle_options(parser: argparse.ArgumentParser) -> None:
    """A region, and what to do to its details."""
    where = parser.add_argument_group("the wrinkle")
    where.add_argument("--frame", type=int, metavar="N", help="the key frame, from 0")
    where.add_argument("--curve", metavar="V,V,...", help="along a curve through these vertices ...")
    where.add_argument(
        "--within", metavar="D", default="2%", help="... all within D of it (2%% of the face's diagonal)"
    )
    where.add_argument("--vertices", metavar="IDS", help="or these vertices: 12,15,20 or a file of ids")
    where.add_argument("--region", metavar="[FILE:]NAME", help="or a region by name, from DIR/regions.json or FILE")
    where.add_argument("--save-region", metavar="NAME", help="keep the region in DIR/regions.json")
    where.add_argument("--window", type=frames_range, metavar="A:B", help="frames (found by the wrinkle's strength)")
    where.add_argument("--band", type=float, metavar="EDGES", help="width of the smoothing band (3 edges)")
    where.add_argument("--static", action="store_true", help="the face's own details instead of the moving ones")
    what = parser.add_argument_group("what to do").add_mutually_exclusive_group(required=True)
    what.add_argument("--scale", type=float, metavar="F", help="its depth times F: 2 enhances, 0.5 diminishes")
    what.add_argument("--remove", action="store_true", help="the same as --scale 0")
    what.add_argument("--paste-to", type=int, metavar="V", help="copy it to another place; --from is what goes there")
    what.add_argument("--mirror", action="store_true", help="copy it to the other side of the face")
    what.add_argument("--reshape-to", metavar="V,V,...", help="bend its --curve to one through these vertices")
    what.add_argument("--gain", metavar="G | N=G,...", help="details times G in all frames, or by a curve over frames")
    copies = parser.add_argument_group("copies")
    copies.add_argument("--from", type=int, dest="start", metavar="V", help="the vertex that goes there (the middle)")
    copies.add_argument("--turn", type=float, default=0.0, metavar="DEGREES", help="turned counter-clockwise (0)")
    copies.add_argument("--times", type=float, default=1.0, metavar="F", help="so many times as large (1)")
    copies.add_argument("--strength", type=float, default=1.0, metavar="F", help="and so many times as deep (1)")
    copies.add_argument("--source-frame", type=int, metavar="N", help="taken from another frame")
    copies.add_argument("--source-shot", metavar="DIR", help="taken from another shot of the same topology")
    copies.add_argument("--hold", action="store_true", help="as it is in that frame, not as it goes on there")
    copies.add_argument("--over", action="store_true", help="over what is there, not in its place")


def wrinkle_of(options: argparse.Namespace, session: EditSession) -> DetailEdit:
    """The detail edit that the options ask for."""
    from toolkit.detail_edit import GainEdit, PasteEdit, ReshapeEdit, ScaleEdit, drawn
    from toolkit.editing.regions import load_regions, save_regions

    surface = session.detail_take.surface
    region = _region(options, session)
    if options.save_region and region is not None:
        save_regions(session.shot, load_regions(session.shot) | {options.save_region: region})
    band = {} if options.band is None else {"band": options.band}
    details = "static" if options.static else "dynamic"
    if options.gain is not None:
        return GainEdit(gains=_gains(options.gain), region=region, details=details, **band)
    if region is None or options.frame is None:
        raise InputError(
            "an edit of a wrinkle needs a --frame and a region",
            remedy="give --curve, --vertices or --region; only --gain may be for the whole face",
        )
    common: dict[str, Any] = {"region": region, "frame": options.frame, "window": options.window, "details": details}
    common |= band
    if options.scale is not None or options.remove:
        return ScaleEdit(factor=0.0 if options.remove else options.scale, **common)
    if options.reshape_to is not None:
        if options.curve is None:
            raise InputError("--reshape-to needs the --curve that the wrinkle runs along")
        curves = [drawn(surface, [surface.at_vertex(v) for v in _ids(t)]) for t in (options.curve, options.reshape_to)]
        return ReshapeEdit(curve=curves[0], goal=curves[1], **common)
    middle = session.rest[region.vertices].mean(axis=0)
    nearest = int(region.vertices[((session.rest[region.vertices] - middle) ** 2).sum(axis=1).argmin()])
    return PasteEdit(
        start=surface.at_vertex(nearest if options.start is None else options.start),
        goal=None if options.paste_to is None else surface.at_vertex(options.paste_to),
        mirror=options.mirror,
        rotation=options.turn,
        scale=options.times,
        strength=options.strength,
        source_frame=options.source_frame,
        source_shot=options.source_shot,
        hold=options.hold,
        add=options.over,
        **common,
    )


def edit_of_file(path: Path) -> list[tuple[str, dict[str, Any]]]:
    """Edits of a JSON file: one object or a list; a pose edit has ``constraints``, a detail edit a ``kind``."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"the file cannot be read as JSON ({error})", where=path, remedy="check it") from error
    edits = data if isinstance(data, list) else [data]
    for edit in edits:
        if not isinstance(edit, dict) or ("constraints" not in edit and "kind" not in edit):
            raise InputError(
                'each edit is an object with "constraints" (poses) or a "kind" (wrinkles)', where=path, remedy="mend it"
            )
    return [("pose" if "constraints" in edit else "detail", edit) for edit in edits]


def frames_range(text: str) -> tuple[int, int]:
    """Parse ``A:B``."""
    try:
        first, last = (int(part) for part in text.replace(",", ":").split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a range of frames such as 90:150") from None
    return first, last


def _region(options: argparse.Namespace, session: EditSession) -> Region | None:
    from toolkit.detail_edit import Region, drawn, within
    from toolkit.editing.regions import load_regions, read_regions

    if options.region is not None:
        file, _, name = options.region.rpartition(":")
        regions = read_regions(Path(file)) if file else load_regions(session.shot)
        if name not in regions:
            known = ", ".join(regions) or "none"
            raise InputError(f"there is no region {name!r}", where=file, remedy=f"the regions are: {known}")
        return regions[name]
    if options.vertices is not None:
        return Region.whole(_ids(options.vertices))
    if options.curve is not None:
        surface = session.detail_take.surface
        curve = drawn(surface, [surface.at_vertex(vertex) for vertex in _ids(options.curve)])
        return within(surface, curve, session.in_pose_of_bases(_length(options.within, session)))
    return None


def _offset(text: str) -> dict[str, Any]:
    vertex, values = _vertex_and_vector(text)
    return {"kind": "point", "vertex": vertex, "offset": values}


def _place(text: str) -> dict[str, Any]:
    vertex, values = _vertex_and_vector(text)
    return {"kind": "point", "vertex": vertex, "place": values}


def _vertex_and_vector(text: str) -> tuple[int, list[float]]:
    try:
        vertex, _, rest = text.partition("=")
        x, y, z = (float(part) for part in rest.split(","))
        return int(vertex), [x, y, z]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a vertex and three numbers such as 4711=0,0.3,0") from None


def _distance(text: str) -> dict[str, Any]:
    try:
        pair, _, much = text.partition("=")
        a, b = (int(part) for part in pair.split(","))
        name, value = ("factor", float(much[1:])) if much.startswith("x") else ("length", float(much))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not two vertices and a length such as 12,40=x1.2") from None
    return {"kind": "distance", "vertices": [a, b], name: value}


def _ids(text: str) -> list[int]:
    """Ids as they stand, or a file with a JSON list, or numbers with commas or blanks between them."""
    path = Path(text)
    content = path.read_text(encoding="utf-8") if path.is_file() else text
    try:
        values = json.loads(content) if content.lstrip().startswith("[") else content.replace(",", " ").split()
        return [int(value) for value in values]
    except (ValueError, TypeError):
        raise InputError(f"{text!r} is neither a list of vertex ids nor a file of them") from None


def _length(text: str, session: EditSession) -> float:
    try:
        if text.endswith("%"):
            spread = session.rest.max(axis=0) - session.rest.min(axis=0)
            return float(text[:-1]) / 100 * float((spread**2).sum() ** 0.5)
        return float(text)
    except ValueError:
        raise InputError(f"{text!r} is not a length", remedy="give a number, or a share such as 20%") from None


def _gains(text: str) -> tuple[tuple[int, float], ...]:
    try:
        if "=" not in text:
            return ((0, float(text)),)
        pairs: Sequence[tuple[str, ...]] = [tuple(part.split("=")) for part in text.split(",")]
        return tuple((int(frame), float(gain)) for frame, gain in pairs)
    except ValueError:
        raise InputError(f"{text!r} is no gain", remedy="give a number, or frames and gains as 0=1,60=0.3") from None


_HELP = {
    "lambda_b": "weight of the change of the bases (1)",
    "lambda_w": "weight of the change of the curves' motion (10)",
    "lambda_e": "weight of what is asked (10000)",
    "handle": "radius of the disc that a pull takes hold of, as a share of the face's diagonal (0.03)",
    "reach": "how far a pull carries over the surface, as a share of the same (0.1); 0 is no limit",
    "contacts": "how much lids and lips that touch count when weights change; 0 lets them open (1)",
    "smoothness": "frames below which the curves prefer to bend slowly (5)",
    "tolerance": "the rounds end when one gains less than this share (0.05)",
}
