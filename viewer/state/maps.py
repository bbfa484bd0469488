"""The values of the colour maps at the present frame: measured once, and off the main thread where that takes long."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering.fields import coating_fields
from toolkit.shot import Shot
from toolkit.smoothing import smoothing_filter
from toolkit.stages.inputs import load_mesh
from viewer.state.fields import Field, scaled
from viewer.state.panes import Surface

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Maps"]

_UNIT = "the target's unit"
# Of the face's height: what a registration may well be off by, and the least difference that anybody sees.
_FAR, _SEEN = 0.004, 1e-4


class Maps:
    """Keeps the last field of each map, with what it was measured on."""

    def __init__(self, app: App) -> None:
        self._app = app
        self._coating_of: Surface | None = None
        self._known: dict[str, tuple[tuple[Any, ...], Field]] = {}

    def forget(self) -> None:
        """Another shot, or another state of it."""
        self._known.clear()
        self._coating_of = None

    def sensible(self, name: str) -> str:
        """The map that a pair comes with, or one that says something."""
        shown = self._app.editing.snapshot
        return "coating" if name == "difference" and (shown is None or not shown.changed) else name

    def possible(self, name: str) -> bool:
        """Whether the shot has come far enough for a map."""
        if name in ("difference", "coating"):
            return self._app.data.has_result
        return name == "none" or self._app.data.has_registration

    def field(self, name: str) -> Field | None:
        """The values of a map on the right pane's surface at this frame; None where they are not known (yet)."""
        surface = self._app.surface(1)
        if surface.mesh != "source" or not self.possible(name):
            return None
        measure = {"distance": self._distance, "difference": self._difference, "coating": self._of_coating}.get(name)
        return measure(surface) if measure is not None else None

    def _distance(self, surface: Surface) -> Field:
        data = self._app.data
        known = self._known.get("distance")
        if known is None or known[0][0] is not data.distance:
            field = scaled("distance", data.distance, _UNIT, _FAR * data.target_framing.height)
            known = self._known["distance"] = ((data.distance,), field)
        return known[1]

    def _difference(self, surface: Surface) -> Field:
        before, after = self._app.surface_named("before"), self._app.surface_named("result")
        known = self._known.get("difference")
        if known is None or known[0][0] is not before or known[0][1] is not after:
            apart = np.linalg.norm(after.vertices - before.vertices, axis=1)
            least = _SEEN * self._app.data.target_framing.height
            known = self._known["difference"] = ((before, after), scaled("difference", apart, _UNIT, least))
        return known[1]

    def _of_coating(self, surface: Surface) -> Field | None:
        """Found in the worker; the last one is shown until then."""
        if self._coating_of is not surface and not self._app.play.playing:
            self._coating_of = surface
            shot = self._app.shot
            self._app.run_task(
                "measuring the coating",
                lambda progress: _coating(shot, surface),
                lambda values: self._coating_found(surface, values),
                slot="coating",
                quiet=True,
            )
        known = self._known.get("coating")
        return known[1] if known is not None and len(known[1].values) == len(surface.vertices) else None

    def _coating_found(self, surface: Surface, values: NDArray[np.floating]) -> None:
        field = scaled("coating", values, _UNIT)
        known = self._known.get("coating")
        if known is not None and known[1].scale.high >= field.scale.high > 0.2 * known[1].scale.high:
            field = replace(field, scale=known[1].scale)  # one scale for the whole take, or nothing can be compared
        self._known["coating"] = ((surface,), field)
        self._app.touch("faces")


def _coating(shot: Shot, surface: Surface) -> NDArray[np.floating]:
    """``|L (S - S~)|`` of every vertex, ``(V,)``, in the target's unit, by the filter that the stages used.

    That is the source's, also on the target: a wavelength is a length on the source.
    """
    parameters = shot.config.smoothing.resolved(load_mesh(shot, "source"))
    smoothing = smoothing_filter(surface.triangles, len(surface.vertices), parameters)
    return coating_fields(surface.vertices, surface.triangles, smoothing)[1]
