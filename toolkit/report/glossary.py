"""What the numbers mean and how to judge them, for a technical artist who never saw the paper."""

from __future__ import annotations

import re
from dataclasses import dataclass

__all__ = ["GLOSSARY", "Entry", "explain"]


@dataclass(frozen=True)
class Entry:
    """``pattern`` of the number's name, ``judge`` one sentence; up to ``good`` is fine, above ``poor`` look closely.

    ``share`` numbers are fractions of one and are shown in percent; the limits are fractions too.
    """

    pattern: str
    judge: str
    good: float | None = None
    poor: float | None = None
    share: bool = False


GLOSSARY: tuple[Entry, ...] = (
    Entry(
        r"flipped",
        "Triangles turned inside out by the registration. They show as dark specks; none is best.",
        good=0.002,
        poor=0.01,
        share=True,
    ),
    Entry(
        r"wrong_sheet",
        "Vertices that landed on the other lip or lid. They tear when the mouth or the eyes open: add "
        "landmarks or feature lines there.",
        good=0.002,
        poor=0.01,
        share=True,
    ),
    Entry(
        r"landmark.*share",
        "How far landmarks ended from their partners, as a share of the face's height. One large value is "
        "usually one misplaced landmark.",
        good=0.01,
        poor=0.03,
        share=True,
    ),
    Entry(
        r"landmark_worst$",
        "The landmark that ended farthest from its partner.",
    ),
    Entry(
        r"distance.*share",
        "Distance of the fitted face from the target's surface, as a share of the face's height.",
        good=0.002,
        poor=0.01,
        share=True,
    ),
    Entry(
        r"gap",
        "How far lips or lids stay apart that touch in the source. Above half a percent of the face's "
        "height the eye sees it: give feature lines on both rims.",
    ),
    Entry(
        r"stretched",
        "Triangles of the skin whose area changed six times more, or less, than usual. A few at nostrils and ears are "
        "common.",
        good=0.005,
        poor=0.02,
        share=True,
    ),
    Entry(
        r"accepted",
        "How much of the skin found its place on the target; the rest follows its neighbours.",
        share=True,
    ),
    Entry(
        r"misfit",
        "How unlike the two faces are: what is left between the landmarks after moving, turning and scaling.",
    ),
    Entry(
        r"jitter",
        "Trembling from frame to frame beside the source's, scaled by how much each face moves: 1 is as much as the "
        "performer has. The worst parts are usually calm ones near a quick motion.",
    ),
    Entry(
        r"error_share",
        "What the bases leave out, as a share of the source's large motion. If an expression looks weak, ask for more "
        "bases or a lower threshold.",
        good=0.05,
        poor=0.15,
        share=True,
    ),
    Entry(
        r"error_rms",
        "What the bases leave out of the source's large motion. If an expression looks weak, ask for more "
        "bases or a lower threshold.",
    ),
    Entry(
        r"^bases$",
        "How many frames serve as bases. Ten to thirty is usual for a take.",
    ),
    Entry(
        r"smoothing_steps",
        "How far the smoothing reaches: shorter features travel as wrinkles, longer ones as shape.",
    ),
    Entry(
        r"gain",
        "Factor on the transferred wrinkles; below one for smooth faces, such as a child's.",
    ),
    Entry(
        r"size_ratio",
        "Size of the target's face relative to the source's; motion is scaled by it.",
    ),
)


def explain(name: str) -> Entry | None:
    """Return the first entry whose pattern occurs in the last part of ``name`` (dotted), else in all of it, or None."""
    leaf, whole = name.rsplit(".", 1)[-1].lower(), name.lower()
    for text in (leaf, whole):
        for entry in GLOSSARY:
            if re.search(entry.pattern, text):
                return entry
    return None
