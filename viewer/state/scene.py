"""What the two panes show of a shot, and from where: surfaces, cameras, colours, and what lies under a pixel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering import Camera
from viewer.picking import Picker
from viewer.shading import CLAY, SKIN, Light
from viewer.state.cameras import Viewpoint
from viewer.state.events import Hit
from viewer.state.panes import PAIRS, Pair, Surface
from viewer.state.playhead import Playhead
from viewer.state.session import Editing
from viewer.state.shot_data import ShotData

__all__ = ["Scene"]

_STILL = ("source reference", "target reference", "registered")
_INSIDE = 0.25
_EDITED = {"result": True, "before": False}


class Scene:
    """The faces of one shot at the present frame.

    Parameters
    ----------
    data : the shot as read
    editing : builds the frames of the result, with and without edits
    """

    def __init__(self, data: ShotData, editing: Editing) -> None:
        self.data, self.editing = data, editing
        self.play = Playhead(data.n_frames, data.fps)
        self.views = [Viewpoint(), Viewpoint()]
        self.linked = True
        self.light = Light()
        self.map = "none"
        self.pair: Pair = PAIRS["performance" if data.has_result else "references"]
        self.pane_sizes = [(700, 700), (700, 700)]
        self.density = 1.0  # pixels of the screen for one of a plain screen
        self._revision = 0
        self._surfaces: dict[str, tuple[Any, Surface]] = {}
        self._pickers: dict[str, tuple[Surface, Picker]] = {}
        self._late: set[str] = set()
        self._skins: dict[tuple[float, ...], tuple[NDArray[np.bool_], NDArray[np.float32]]] = {}

    # -- surfaces -------------------------------------------------------------------------------------------------

    def shown(self, pane: int) -> str:
        """The name of a pane's surface."""
        return self.pair.right if pane else self.pair.left

    def surface(self, pane: int) -> Surface:
        """The face in a pane, at the present frame."""
        return self.surface_named(self.shown(pane))

    def surface_named(self, name: str) -> Surface:
        """A surface of `PAIRS` at the present frame, or the last one while that is being built."""
        key = (self._revision, None if name in _STILL else self.play.frame)
        known = self._surfaces.get(name)
        if known is not None and known[0] == key:
            return known[1]
        # With edits and without them it is the same face: better one for the other for a moment than to wait.
        last = known or next((self._surfaces[other] for other in _EDITED if other in self._surfaces), None)
        made = self._make_surface(name, wait=last is None)
        if made is None:
            assert last is not None
            self._late.add(name)
            return last[1]
        self._late.discard(name)
        self._surfaces[name] = (key, made)
        return made

    def arrived(self) -> bool:
        """Whether a surface that was late can be shown now."""
        if not any(self.editing.ready(self.play.frame, _EDITED[name]) for name in self._late):
            return False
        self._late.clear()
        return True

    def catch_up(self) -> None:
        """Wait for what is late: what is done now has to be about the frame that is said to be shown."""
        for name in [name for name in self._late if name in (self.pair.left, self.pair.right)]:
            self.editing.frame(self.play.frame, _EDITED[name])
        self._late.clear()

    def wanted(self) -> set[bool]:
        """Which frames of the result are shown: True those with edits, False those without."""
        names = {self.pair.left, self.pair.right} | ({"before"} if self.map == "difference" else set())
        return {edited for name, edited in _EDITED.items() if name in names}

    def forget_surfaces(self, *, stills: bool = False) -> None:
        """Shapes are not what they were; with ``stills`` those of the neutral faces neither."""
        self._revision += 1
        self._late.clear()
        if stills:
            self._surfaces.clear()
            self._pickers.clear()

    def extras(self, pane: int) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """What belongs beside the face in a pane, eyeballs for one: positions (N, 3) and triangles (F, 3)."""
        name = self.shown(pane)
        extras = self.data.source_extras if name.startswith("source") else self.data.target_extras
        if extras is None:
            return None
        places = extras.rest if name in _STILL else extras.frame(self.play.frame)
        return places.astype(np.float32), extras.triangles

    def skin(self, surface: Surface) -> NDArray[np.float32]:
        """The colour of a face, ``(1, 3)``, or ``(V, 3)`` with the inside of mouth and eyes darker, if it is known."""
        color = CLAY if surface.name in _STILL else SKIN
        inside = self.data.interior if surface.mesh == "source" else None
        if inside is None or len(inside) != len(surface.vertices):
            return np.array([color], np.float32)
        known = self._skins.get(color)
        if known is None or known[0] is not inside:
            colors = np.where(inside[:, None], np.float32(_INSIDE), np.float32(1)) * np.array(color, np.float32)
            known = self._skins[color] = (inside, colors)
        return known[1]

    def _make_surface(self, name: str, wait: bool) -> Surface | None:
        """None where it has to be built first, which is not waited for."""
        data, frame = self.data, self.play.frame
        if name == "target reference":
            mesh = data.target
            return Surface(name, "target", _owned(mesh.vertices), mesh.triangles, data.target_framing)
        framing = data.source_framing if name.startswith("source") else data.target_framing
        vertices: NDArray[np.floating] | None
        if name in _EDITED:
            build = self.editing.frame if wait else self.editing.frame_soon
            vertices = build(frame, _EDITED[name])
        elif name == "source":
            vertices = data.source_frame(frame)
        else:
            vertices = data.source.vertices if name == "source reference" else data.registered
        if vertices is None:
            return None
        return Surface(name, "source", _owned(vertices), data.source.triangles, framing)

    # -- cameras and picking --------------------------------------------------------------------------------------

    def view_of(self, pane: int) -> Viewpoint:
        """From where a pane looks."""
        return self.views[0 if self.linked else pane]

    def framing_camera(self, pane: int) -> Camera:
        """The camera of a pane."""
        return self.view_of(pane).camera(self.surface(pane).framing)

    def plain_height(self, pane: int) -> float:
        """A pane's height in pixels of a plain screen: what is a few pixels large is as large on a dense one."""
        return self.pane_sizes[pane][1] / self.density

    def picker(self, pane: int) -> Picker:
        """The picker of the face as displayed."""
        surface = self.surface(pane)
        known = self._pickers.get(surface.name)
        if known is None or known[0] is not surface:
            same = next((p for s, p in self._pickers.values() if s.triangles is surface.triangles), None)
            picker = same.moved(surface.vertices) if same else Picker(surface.vertices, surface.triangles)
            known = self._pickers[surface.name] = (surface, picker)
        return known[1]

    def pick(self, pane: int, x: float, y: float) -> Hit | None:
        """What a pixel of a pane shows."""
        return self.picker(pane).pick(self.framing_camera(pane), x, y, self.pane_sizes[pane])


def _owned(vertices: NDArray[np.floating]) -> NDArray[np.float32]:
    """In memory, and not read-only: compiled code takes that for another type, and would be compiled again."""
    return (
        np.array(vertices, np.float32) if not vertices.flags.writeable else np.ascontiguousarray(vertices, np.float32)
    )
