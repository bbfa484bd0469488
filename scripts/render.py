#!/usr/bin/env python3
"""Contact sheet, side-by-side video, close-ups and colour maps of one or several shots. No display needed.

With several shots of the same performance the source is shown once, then every result. Everything goes to
DIR/render of the first shot.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from _cli import parser_for, run
from _views import add_axes, numbers_list, positive, positive_number, warn_of_old_result

from toolkit.errors import InputError
from toolkit.progress import Progress

if TYPE_CHECKING:
    from toolkit.rendering.shots import ShotViews
    from toolkit.shot import Shot

_MAPS = ("coating", "registration", "motion")


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Render what was asked for, the contact sheet if nothing else was."""
    from toolkit.rendering.shots import expressive_frames, open_views
    from toolkit.shot import Shot

    shots = [Shot(path) for path in options.shots]
    for shot in shots:
        warn_of_old_result(shot)
    opened = [open_views(shot, forward=options.forward, up=options.up) for shot in shots]
    if len({views.source.n_frames for views in opened}) > 1:
        raise InputError("the shots have takes of different lengths", remedy="render them one at a time")
    frames = options.frames or expressive_frames(shots[0], options.count)
    folder = Path(options.out) if options.out else shots[0].render_folder
    made = [_sheet(opened, frames, folder / "contact_sheet.png", options, progress)]
    made += _close_ups(opened, frames, folder, options, progress)
    made += [_map(shots, opened, name, frames, folder, progress) for name in options.map]
    if options.video:
        made.append(_video(opened, folder / "performance.mp4", options, progress))
    for path in made:
        print(path)
    return {"frames": frames, "files": [str(path) for path in made]}


def _views(opened: list[ShotViews]) -> list[Any]:
    return [opened[0].source, *(views.target for views in opened)]


def _sheet(
    opened: list[ShotViews], frames: list[int], path: Path, options: argparse.Namespace, progress: Progress
) -> Path:
    from toolkit.rendering.takes import performance_sheet

    sheet = performance_sheet(
        _views(opened), frames, width=options.width, turn=options.turn, title=options.title, progress=progress
    )
    return _save(sheet, path)


def _close_ups(
    opened: list[ShotViews], frames: list[int], folder: Path, options: argparse.Namespace, progress: Progress
) -> list[Path]:
    from toolkit.rendering.regions import CLOSE_UPS, close_up_vertices
    from toolkit.rendering.takes import performance_sheet

    paths = []
    for name in options.close_up:
        only = close_up_vertices(name, opened[0].source.rest, opened[0].landmarks)
        if only is None:
            raise InputError(
                f"too few landmarks are named after the {name} to find a close-up",
                where=options.shots[0],
                remedy="name them in landmarks.json, such as eye_inner_l, mouth_corner_r, brow_mid_l",
            )
        aspect, width = CLOSE_UPS[name][2], round(1.4 * options.width)
        steady = [opened[0].steady()[0], *(views.steady()[1] for views in opened)]
        sheet = performance_sheet(steady, frames, width=width, aspect=aspect, only=only, progress=progress)
        paths.append(_save(sheet, folder / f"contact_sheet_{name}.png"))
    return paths


def _map(
    shots: list[Shot], opened: list[ShotViews], name: str, frames: list[int], folder: Path, progress: Progress
) -> Path:
    from toolkit.report.maps import map_sheet

    sheet = map_sheet(name, shots, opened, frames)
    progress(f"rendering the map of the {name}", 1, 1)
    return _save(sheet, folder / f"{name}.png")


def _video(opened: list[ShotViews], path: Path, options: argparse.Namespace, progress: Progress) -> Path:
    from toolkit.rendering import write_video
    from toolkit.rendering.takes import performance_video

    if options.every < 1:
        raise InputError(f"--every {options.every} makes no sense", remedy="give 1 for every frame, 2 for every second")
    frames = range(0, opened[0].source.n_frames, options.every)
    images = performance_video(_views(opened), frames, height=options.height, turn=options.turn, progress=progress)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_video(path, images, options.fps or opened[0].fps / options.every)
    return path


def _save(image: Any, path: Path) -> Path:
    from PIL import Image

    from toolkit.meshio.aside import written_aside

    with written_aside(path) as temporary:
        Image.fromarray(image).save(temporary, "PNG", optimize=True)
    return path


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__, shot=False)
    made.add_argument("shots", metavar="DIR", nargs="+", type=Path, help="shot folders")
    made.add_argument(
        "--count", type=positive, default=7, metavar="N", help="frames on the sheets, chosen to differ (7)"
    )
    made.add_argument("--frames", type=numbers_list, metavar="A,B,...", help="or exactly these frames")
    made.add_argument(
        "--close-up", action="append", default=[], choices=["features", "eyes", "mouth", "forehead"], help="repeatable"
    )
    made.add_argument("--map", action="append", default=[], choices=_MAPS, help="colour map, repeatable")
    made.add_argument("--video", action="store_true", help="also the side-by-side video")
    made.add_argument(
        "--every", type=int, default=1, metavar="N", help="every Nth frame of the video, in real time (1)"
    )
    made.add_argument("--fps", type=positive_number, help="the video's frame rate, if not the take's")
    made.add_argument("--width", type=positive, default=300, help="width of a picture on the sheet in pixels (300)")
    made.add_argument("--height", type=positive, default=600, help="height of the video in pixels (600)")
    made.add_argument("--turn", type=float, default=0.0, metavar="DEGREES", help="look from the side (0)")
    made.add_argument("--title", default="", help="written on the contact sheet")
    made.add_argument("--out", metavar="FOLDER", help="where to write (DIR/render)")
    add_axes(made)
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
