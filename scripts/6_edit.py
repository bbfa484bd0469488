#!/usr/bin/env python3
"""Step 6: edit poses and wrinkles in space and time, without the viewer. Frames and vertices are numbered from 0.

    6_edit.py DIR add --frame 120 --point 4711=0,0.3,0 --window 90:150     a pose: the edit spreads over the window
    6_edit.py DIR add --frame 120 --distance 12,40=x1.2 --mode bases       every frame of a similar expression follows
    6_edit.py DIR wrinkle --frame 120 --curve 812,840,901 --scale 2        a wrinkle: deeper while it lasts
    6_edit.py DIR wrinkle --frame 120 --brush 812=3% --mirror               copied to the other side of the face
    6_edit.py DIR region brow --curve 812,840,901 --grow 1%                 a region to be used again: --region brow
    6_edit.py DIR list | undo | redo | off N | on N | remove N
    6_edit.py DIR preview 100 120                                          pictures: before, after, difference
    6_edit.py DIR apply                                                    writes result/frames.npy

Edits go to DIR/edits.jsonl, a line each, and are on disk before the command ends. Nothing else changes until "apply",
or the next run_all.py.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from _cli import parser_for, run
from _edit_options import add_pose_options, edit_of_file, pose_of
from _views import add_axes
from _wrinkle_options import add_region_options, add_wrinkle_options, region_of, wrinkle_of

from toolkit.progress import Progress

if TYPE_CHECKING:
    from toolkit.editing import EditSession
    from toolkit.shot import Shot
    from toolkit.shot.journal import Edit, Journal


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Do what the subcommand says."""
    from toolkit.shot import Shot

    done: dict[str, Any] = _COMMANDS[options.command](Shot(options.shot), options, progress)
    return done


def add(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Solve an edit and add it, or with a number put it in an old one's place."""
    from toolkit.editing import EditSession
    from toolkit.errors import InputError

    session = EditSession.open(shot, progress)
    number = getattr(options, "number", None)
    edits = [] if options.file is None else edit_of_file(options.file)
    asked = pose_of(options, session)
    edits += [] if asked is None else [("pose", asked)]
    if not edits or (number is not None and len(edits) != 1):
        raise InputError(
            f"{len(edits)} edits are asked for" if edits else "nothing is asked for",
            remedy="give --frame with --point, --place or --distance, or --file",
        )
    return _take_up(session, edits, number, options, progress)


def wrinkle(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Solve an edit of a wrinkle and add it, or put it in an old one's place."""
    from toolkit.detail_edit import to_data
    from toolkit.editing import EditSession

    session = EditSession.open(shot, progress)
    asked = to_data(wrinkle_of(options, session))
    return _take_up(session, [("detail", asked)], options.change, options, progress)


def region(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Keep a region by name, or say which there are."""
    from toolkit.editing import EditSession
    from toolkit.editing.regions import load_regions, save_regions
    from toolkit.errors import InputError

    regions = load_regions(shot)
    if options.name is not None:
        selected = region_of(options, EditSession.open(shot, progress))
        if selected is None or len(selected) == 0:
            raise InputError(
                "the region is empty", remedy="give --curve, --brush, --vertices or --region, and a larger distance"
            )
        regions[options.name] = selected
        save_regions(shot, regions)
    for name, one in regions.items():
        print(f"{name}: {len(one):,} vertices")
    if not regions:
        print("no regions")
    return {"regions": {name: len(one) for name, one in regions.items()}}


def _take_up(
    session: EditSession,
    edits: list[tuple[str, dict[str, Any]]],
    number: int | None,
    options: argparse.Namespace,
    progress: Progress,
) -> dict[str, Any]:
    told = []
    for kind, given in edits:
        data = given | ({"note": options.note} if options.note else {})
        if number is None:
            number = session.add(kind, data, progress).number
        else:
            session.change(number, data, progress)
        edit = next(one for one in session.edits if one.number == number)
        told.append(_told(edit, session))
        number = None
    files = [] if options.preview is None else _pictures(session, options.preview, options, progress)
    print(f'next: scripts/6_edit.py {quote(str(options.shot))} apply, or "undo"')
    return {"edits": told, "files": files}


def _told(edit: Edit, session: EditSession) -> dict[str, Any]:
    """Say what an edit came to; contradictions show as residuals."""
    from toolkit.detail_edit import DetailChange
    from toolkit.editing.moved import n_moved
    from toolkit.editing.words import describe

    moved = session.edited_frames()
    print(f"edit {edit.number}: {describe(edit)}")
    residuals = [{"asked": one.asked, "left": one.left} for one in session.residuals(edit.number)]
    for constraint, residual in zip(edit.data.get("constraints", []), residuals, strict=False):
        print(f"  {constraint['kind']:<9} asked {residual['asked']:.4g}, left {residual['left']:.4g}")
    data: dict[str, Any] = {"number": edit.number, "kind": edit.kind, "residuals": residuals}
    solved = session.solved(edit.number)
    if isinstance(solved, DetailChange) and len(solved.activation):
        data |= {"window": list(solved.window), "vertices": len(solved.vertices)}
        print("  frames {} to {}".format(*solved.window) + f", {len(solved.vertices):,} vertices with the band")
    count, most = n_moved(moved), float(moved.max())
    print(f"  all edits together move {count} of {len(moved)} frames, by {most:.4g} at most (the target's unit)")
    return data | {"moved_frames": count, "moved_most": most}


def list_edits(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Say what is in the journal."""
    from toolkit.editing.words import describe

    replay = _journal(shot).replay()
    for edit in replay.edits:
        print(f"{edit.number:>4}  {'on ' if edit.on else 'off'}  {describe(edit)}")
    if not replay.edits:
        print("no edits")
    edits = [{"number": e.number, "kind": e.kind, "on": e.on, "words": describe(e)} for e in replay.edits]
    return {"edits": edits, "can_undo": replay.undo is not None, "can_redo": replay.redo is not None}


def undo_or_redo(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Take back the last step, or do it again."""
    journal = _journal(shot)
    step = journal.undo() if options.command == "undo" else journal.redo()
    print(f"nothing to {options.command}" if step is None else f"{options.command}: {step.name} of edit {step.edit}")
    return {"step": None if step is None else {"name": step.name, "edit": step.edit}}


def switch_or_remove(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Switch an edit off or on, or take it away."""
    journal = _journal(shot)
    if options.command == "remove":
        journal.remove(options.number)
    else:
        journal.switch(options.number, options.command == "on")
    print(f"edit {options.number}: {'removed' if options.command == 'remove' else options.command}")
    return {"edit": options.number}


def apply(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Bring the result up to date with the edits."""
    from toolkit.stages import run_stages

    report = run_stages(shot, ["result"], progress=progress)[-1]
    for name, value in report.numbers.items():
        print(f"  {name}: {value:.6g}" if isinstance(value, float) else f"  {name}: {value}")
    print(f"result: {shot.frames_path}" + (" (up to date)" if report.skipped else ""))
    return {"result": str(shot.frames_path), "skipped": report.skipped, "numbers": report.numbers}


def preview(shot: Shot, options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Render frames before and after the edits."""
    from toolkit.editing import EditSession

    return {"files": _pictures(EditSession.open(shot, progress), options.frames, options, progress)}


def _pictures(session: EditSession, frames: list[int], options: argparse.Namespace, progress: Progress) -> list[str]:
    from PIL import Image

    from toolkit.editing.preview import preview_sheet
    from toolkit.meshio.aside import written_aside
    from toolkit.rendering.shots import open_views

    views = open_views(session.shot, forward=options.forward, up=options.up)
    looks = {"width": options.width, "turn": options.view_turn, "close_up": options.close_up}
    sheet = preview_sheet(views, frames, session.unedited_frame, session.frame, **looks)
    path: Path = options.out or session.shot.render_folder / "edit_preview.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_aside(path) as temporary:
        Image.fromarray(sheet).save(temporary, "PNG", optimize=True)
    print(path)
    return [str(path)]


def _journal(shot: Shot) -> Journal:
    from toolkit.shot.journal import Journal

    return Journal(shot.edits_path)


_COMMANDS = {
    "add": add,
    "change": add,
    "wrinkle": wrinkle,
    "region": region,
    "list": list_edits,
    "undo": undo_or_redo,
    "redo": undo_or_redo,
    "on": switch_or_remove,
    "off": switch_or_remove,
    "remove": switch_or_remove,
    "apply": apply,
    "preview": preview,
}


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__)
    common = argparse.ArgumentParser(add_help=False)
    for names, words in ((("-v", "--verbose"), "say more"), (("--json",), "end with one line of JSON")):
        common.add_argument(*names, action="store_true", default=argparse.SUPPRESS, help=words)
    commands = made.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def command(name: str, words: str) -> argparse.ArgumentParser:
        return commands.add_parser(name, help=words, description=words, parents=[common])

    for name, words in (("add", "edit a pose"), ("change", "give an edit other constraints")):
        one = command(name, words)
        if name == "change":
            _add_number(one)
        add_pose_options(one)
        one.add_argument("--file", type=Path, metavar="JSON", help="edits from a file, as the journal holds them")
        _add_outcome(one)
    one = command("wrinkle", "edit a wrinkle")
    add_wrinkle_options(one)
    one.add_argument("--change", type=int, metavar="N", help="in the place of edit N")
    _add_outcome(one)
    one = command("region", "keep a region by name, or list them")
    one.add_argument("name", nargs="?", metavar="NAME", help="its name (all are listed)")
    add_region_options(one)
    command("list", "all edits")
    command("undo", "take back the last step")
    command("redo", "do it again")
    for name, words in (("off", "switch an edit off"), ("on", "and on again"), ("remove", "take an edit away")):
        _add_number(command(name, words))
    command("apply", "write the result with all edits that are on")
    one = command("preview", "pictures of frames before and after the edits")
    one.add_argument("frames", type=int, nargs="+", metavar="FRAME")
    _add_looks(one)
    return made


def _add_number(one: argparse.ArgumentParser) -> None:
    one.add_argument("number", type=int, metavar="N", help='the edit\'s number, see "list"')


def _add_outcome(one: argparse.ArgumentParser) -> None:
    one.add_argument("--note", default="", help="a remark for the list")
    one.add_argument("--preview", type=int, nargs="+", metavar="FRAME", help="also pictures of these frames")
    _add_looks(one)


def _add_looks(one: argparse.ArgumentParser) -> None:
    group = one.add_argument_group("pictures")
    group.add_argument("--out", type=Path, metavar="PNG", help="where to write (DIR/render/edit_preview.png)")
    group.add_argument("--close-up", choices=["eyes", "mouth", "forehead"], help="only this part of the face")
    group.add_argument("--width", type=int, default=480, help="width of a picture in pixels (480)")
    group.add_argument("--view-turn", type=float, default=0.0, metavar="DEGREES", help="look from the side (0)")
    add_axes(group)


if __name__ == "__main__":
    sys.exit(run(parser(), main))
