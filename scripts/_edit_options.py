"""Options that say an edit of poses on the command line, and what they mean."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from _cli import chosen

from toolkit.errors import InputError

if TYPE_CHECKING:
    from toolkit.editing import EditSession

__all__ = ["add_pose_options", "edit_of_file", "frames_range", "length_of", "pose_of", "vertex_ids"]

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
        spread.add_argument(f"--{name.replace('_', '-')}", type=finite_number, metavar="X", help=_HELP[name])


def pose_of(options: argparse.Namespace, session: EditSession) -> dict[str, Any] | None:
    """The pose edit as data for the journal; None where nothing is asked."""
    constraints: list[dict[str, Any]] = list(options.asked or [])
    for text in options.fix:
        constraints.append({"kind": "fixed", "vertices": vertex_ids(text)})
    if options.fix_farther_than is not None:
        constraints.append({"kind": "beyond", "distance": length_of(options.fix_farther_than, session)})
    if not constraints:
        return None
    parameters = chosen(options, "mode", "window", *_NUMBERS)
    return {"constraints": constraints, "parameters": {k: v for k, v in parameters.items() if v is not None}}


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


def finite_number(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def _offset(text: str) -> dict[str, Any]:
    vertex, values = _vertex_and_vector(text)
    return {"kind": "point", "vertex": vertex, "offset": values}


def _place(text: str) -> dict[str, Any]:
    vertex, values = _vertex_and_vector(text)
    return {"kind": "point", "vertex": vertex, "place": values}


def _vertex_and_vector(text: str) -> tuple[int, list[float]]:
    try:
        vertex, _, rest = text.partition("=")
        x, y, z = (finite_number(part) for part in rest.split(","))
        return int(vertex), [x, y, z]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a vertex and three numbers such as 4711=0,0.3,0") from None


def _distance(text: str) -> dict[str, Any]:
    try:
        pair, _, much = text.partition("=")
        a, b = (int(part) for part in pair.split(","))
        name, value = ("factor", finite_number(much[1:])) if much.startswith("x") else ("length", finite_number(much))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not two vertices and a length such as 12,40=x1.2") from None
    return {"kind": "distance", "vertices": [a, b], name: value}


def vertex_ids(text: str) -> list[int]:
    """Ids as they stand, or a file with a JSON list, or numbers with commas or blanks between them."""
    path = Path(text)
    content = path.read_text(encoding="utf-8") if path.is_file() else text
    try:
        values = json.loads(content) if content.lstrip().startswith("[") else content.replace(",", " ").split()
        return [int(value) for value in values]
    except (ValueError, TypeError):
        raise InputError(
            f"{text!r} is neither a list of vertex ids nor a file of them",
            remedy="give ids such as 12,57 or the path of a file with them",
        ) from None


def length_of(text: str, session: EditSession) -> float:
    """A length in the target's unit, or a share of the face's diagonal such as ``2%``."""
    try:
        if text.endswith("%"):
            spread = session.rest.max(axis=0) - session.rest.min(axis=0)
            return float(text[:-1]) / 100 * float((spread**2).sum() ** 0.5)
        return float(text)
    except ValueError:
        raise InputError(f"{text!r} is not a length", remedy="give a number, or a share such as 20%") from None


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
