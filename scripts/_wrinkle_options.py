"""Options that say a region of the face and an edit of its wrinkles on the command line, and what they mean."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from os.path import relpath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from _cli import chosen
from _edit_options import frames_range, length_of, vertex_ids

from toolkit.errors import InputError

if TYPE_CHECKING:
    from toolkit.detail_edit import Curve, Dab, DetailEdit, Region
    from toolkit.editing import EditSession

__all__ = ["add_region_options", "add_wrinkle_options", "region_of", "wrinkle_of"]

_COPY: dict[str, Any] = {
    "rotation": 0.0,
    "scale": 1.0,
    "mirror": False,
    "strength": 1.0,
    "source_frame": None,
    "source_shot": None,
    "hold": False,
    "add": False,
}
"""What a copy asks for by default: the wrinkle as it is."""


def add_region_options(parser: argparse.ArgumentParser) -> None:
    """Ways to say a region. All that is given counts together; lengths go along the skin."""
    group = parser.add_argument_group(
        "the region", "lengths D go along the skin, in the target's unit or as 2% of the face's diagonal"
    )
    group.add_argument("--vertices", metavar="IDS", help="these vertices: 12,15,20 or a file of ids")
    group.add_argument("--region", metavar="[FILE:]NAME", help="a region by name, from DIR/regions.json or FILE")
    group.add_argument("--curve", metavar="V,V,...", help="all near a curve through these vertices:")
    group.add_argument("--within", metavar="D", default="2%", help="up to D from it (2%%),")
    group.add_argument("--soft", metavar="D", default="0", help="fading over D more (0)")
    for name, what in (("brush", "painted"), ("erase", "and erased")):
        group.add_argument(
            f"--{name}",
            metavar="V=D",
            action="append",
            default=[],
            help=f"{what} with a soft brush of radius D at vertex V; any number",
        )
    group.add_argument("--hardness", type=float, default=0.5, metavar="H", help="share of D where it is full (0.5)")
    group.add_argument("--grow", metavar="D", help="then larger by D ...")
    group.add_argument("--shrink", metavar="D", help="... or smaller")
    group.add_argument("--other-side", action="store_true", help="the same place on the other side of the face instead")


def region_of(options: argparse.Namespace, session: EditSession) -> Region | None:
    """The region that the options select, None where they select nothing."""
    from toolkit.detail_edit import Region, grown, painted, shrunk, within

    surface = session.detail_take.surface
    parts = [] if options.region is None else [_named(options.region, session)]
    if options.vertices is not None:
        parts.append(Region.whole(vertex_ids(options.vertices)))
    if options.curve is not None:
        reach, soft = (_on_skin(length, session) for length in (options.within, options.soft))
        parts.append(within(surface, _curve(options.curve, session), reach, soft))
    dabs = _dabs(options, session)
    if not parts and not dabs:
        return None
    region = parts[0] if parts else Region.whole([])
    for part in parts[1:]:
        region = region.joined(part)
    surface.check_vertices(region.vertices)
    region = painted(surface, dabs, region)
    for change, length in ((grown, options.grow), (shrunk, options.shrink)):
        if length is not None:
            region = change(surface, region, _on_skin(length, session))
    return session.detail_take.mirror.region(region) if options.other_side else region


def add_wrinkle_options(parser: argparse.ArgumentParser) -> None:
    """A region, and what to do to its details."""
    add_region_options(parser)
    parser.add_argument("--save-region", metavar="NAME", help="keep the region in DIR/regions.json")
    when = parser.add_argument_group("when and how far")
    when.add_argument("--frame", type=int, metavar="N", help="the key frame, from 0")
    when.add_argument(
        "--window", type=frames_range, metavar="A:B", help="first and last frame (those in which it is there)"
    )
    when.add_argument("--threshold", type=float, metavar="X", help="there is: this share of the key frame's (0.23)")
    when.add_argument("--band", type=float, metavar="EDGES", help="width of the smoothing band (3 edges)")
    when.add_argument(
        "--propagation",
        choices=["follow", "gradients"],
        help="how it goes on in time: with the performance, or by the paper's least squares (follow)",
    )
    when.add_argument("--static", action="store_true", help="the face's own details instead of the moving ones")
    what = parser.add_argument_group("what to do").add_mutually_exclusive_group()
    what.add_argument("--scale", type=float, dest="factor", metavar="F", help="its depth times F: 2 enhances")
    what.add_argument(
        "--remove",
        action="store_const",
        const=0.0,
        dest="factor",
        help="the same as --scale 0 (broad ones want a longer [smoothing] wavelength)",
    )
    what.add_argument("--paste-to", type=int, metavar="V", help="copy it to another place; --from is what goes there")
    what.add_argument("--reshape-to", metavar="V,V,...", help="bend its --curve to one through these vertices")
    what.add_argument("--gain", metavar="G | N=G,...", help="details times G in all frames, or by a curve over frames")
    copies = parser.add_argument_group("copies")
    copies.set_defaults(**_COPY)
    copies.add_argument("--mirror", action="store_true", help="mirrored; without --paste-to to the other side")
    copies.add_argument("--from", type=int, dest="start", metavar="V", help="the vertex that goes there (the middle)")
    copies.add_argument("--turn", type=float, dest="rotation", metavar="DEGREES", help="counter-clockwise")
    copies.add_argument("--times", type=float, dest="scale", metavar="F", help="F times as large (1)")
    copies.add_argument("--strength", type=float, metavar="F", help="and F times as deep (1)")
    copies.add_argument("--source-frame", type=int, metavar="N", help="taken from another frame")
    copies.add_argument("--source-shot", metavar="DIR", help="taken from another shot of the same topology")
    copies.add_argument("--hold", action="store_true", help="as it is in that frame, not as it goes on there")
    copies.add_argument("--over", action="store_true", dest="add", help="over what is there, not in its place")


def wrinkle_of(options: argparse.Namespace, session: EditSession) -> DetailEdit:
    """The detail edit that the options ask for."""
    from toolkit.detail_edit import GainEdit, ReshapeEdit, ScaleEdit
    from toolkit.editing.regions import load_regions, save_regions

    region = region_of(options, session)
    if options.save_region and region is not None:
        save_regions(session.shot, load_regions(session.shot) | {options.save_region: region})
    common: dict[str, Any] = {"region": region, "details": "static" if options.static else "dynamic"}
    common |= _given(options, "band")
    if options.gain is not None:
        return GainEdit(gains=_gains(options.gain), **common)
    if region is None or options.frame is None:
        raise InputError(
            "an edit of a wrinkle needs a --frame and a region",
            remedy="give --curve, --brush, --vertices or --region; only --gain may be for the whole face",
        )
    common |= _given(options, "frame", "window", "threshold", "propagation")
    if options.factor is not None:
        return ScaleEdit(factor=options.factor, **common)
    if options.reshape_to is None:
        return _copy(options, session, common)
    if options.curve is None:
        raise InputError("--reshape-to needs the --curve that the wrinkle runs along", remedy="give --curve, too")
    curve, goal = (_curve(text, session) for text in (options.curve, options.reshape_to))
    return ReshapeEdit(curve=curve, goal=goal, **common)


def _seen_from(shot: Path, text: str) -> str:
    """A relative path, which a shell means from where one is, as the journal holds it: both can move together."""
    return text if Path(text).is_absolute() else relpath(Path(text).resolve(), shot.resolve())


def _copy(options: argparse.Namespace, session: EditSession, common: dict[str, Any]) -> DetailEdit:
    from toolkit.detail_edit import PasteEdit, middle_of

    copied = chosen(options, *_COPY)
    if options.paste_to is None and copied == _COPY:
        raise InputError(
            "nothing is asked for", remedy="give --scale, --remove, --paste-to, --mirror, --reshape-to or --gain"
        )
    if options.source_shot is not None:
        copied["source_shot"] = _seen_from(session.shot.path, options.source_shot)
    surface = session.detail_take.surface
    start = middle_of(surface, common["region"]) if options.start is None else surface.at_vertex(options.start)
    goal = None if options.paste_to is None else surface.at_vertex(options.paste_to)
    return PasteEdit(start=start, goal=goal, **copied, **common)


def _given(options: argparse.Namespace, *names: str) -> dict[str, Any]:
    return {name: value for name, value in chosen(options, *names).items() if value is not None}


def _named(text: str, session: EditSession) -> Region:
    from toolkit.editing.regions import load_regions, read_regions

    file, _, name = text.rpartition(":")
    regions = read_regions(Path(file)) if file else load_regions(session.shot)
    if name not in regions:
        known = ", ".join(regions) or "none"
        raise InputError(f"there is no region {name!r}", where=file, remedy=f"the regions are: {known}")
    return regions[name]


def _curve(text: str, session: EditSession) -> Curve:
    from toolkit.detail_edit import drawn

    surface = session.detail_take.surface
    return drawn(surface, [surface.at_vertex(vertex) for vertex in vertex_ids(text)])


def _dabs(options: argparse.Namespace, session: EditSession) -> list[Dab]:
    from toolkit.detail_edit import Dab

    surface, dabs = session.detail_take.surface, []
    for text, erase in [(text, False) for text in options.brush] + [(text, True) for text in options.erase]:
        vertex, _, radius = text.partition("=")
        if not vertex.isdecimal():
            raise InputError(f"{text!r} is not a vertex and a radius such as 4711=2%", remedy="write VERTEX=RADIUS")
        point = surface.at_vertex(int(vertex))
        dabs.append(Dab(point, _on_skin(radius, session), hardness=options.hardness, erase=erase))
    return dabs


def _on_skin(text: str, session: EditSession) -> float:
    return session.in_pose_of_bases(length_of(text, session))


def _gains(text: str) -> tuple[tuple[int, float], ...]:
    try:
        if "=" not in text:
            return ((0, float(text)),)
        pairs: Sequence[tuple[str, ...]] = [tuple(part.split("=")) for part in text.split(",")]
        return tuple((int(frame), float(gain)) for frame, gain in pairs)
    except ValueError:
        raise InputError(f"{text!r} is no gain", remedy="give a number, or frames and gains as 0=1,60=0.3") from None
