from __future__ import annotations

import base64
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from toolkit.report import Chart, Figure, ReportData, Section, build, line_chart

_VOID = {"col", "meta", "img", "br", "link", "hr", "input"}


class _Outline(HTMLParser):
    """Collects texts and images, and fails on tags that do not nest."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.images: list[str] = []
        self.targets: set[str] = set()
        self.links: list[str] = []

    def handle_starttag(self, tag, attrs):
        fields = dict(attrs)
        if tag == "img":
            self.images.append(fields["src"])
        if tag == "a":
            self.links.append(fields["href"])
        if "id" in fields:
            self.targets.add(fields["id"])
        if tag not in _VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def page() -> _Outline:
    picture = np.zeros((40, 30, 3), np.uint8)
    picture[:, :15] = (200, 40, 40)
    data = ReportData(
        title="A <shot> & more",
        subtitle="sub",
        summary={"source": {"frames": 120, "vertices": 68949}},
        sections=[
            Section(
                "Registration & fit",
                "Intro.",
                [Figure(picture, 'the "caption"')],
                [Chart(line_chart({"gap": [0, 1, 2]}), "gap per frame")],
                {"flipped_share": 0.0123, "mean_distance": 0.4321},
            ),
            Section("Empty"),
        ],
        links=[("result/frames.npy", "result/frames.npy")],
    )
    outline = _Outline()
    outline.feed(build(data))
    outline.close()
    assert outline.open == []
    return outline


def test_the_page_is_well_formed_and_says_everything(page):
    text = re.sub("[ \n]+", " ", " ".join(page.texts))
    for expected in (
        "A <shot> & more",
        "68\u202f949",
        "120",
        "1.23 %",
        "0.4321",
        "inside out",
        "gap per frame",
        "result/frames.npy",
    ):
        assert expected in text, expected


def test_nothing_is_loaded_from_elsewhere(page):
    assert len(page.images) == 1
    assert all(source.startswith("data:image/") for source in page.images)
    assert not any(re.match("https?:", link) for link in page.links)


def test_every_anchor_leads_somewhere(page):
    inner = [link[1:] for link in page.links if link.startswith("#")]
    assert len(inner) == 2
    assert set(inner) <= page.targets


def test_pictures_survive(page):
    data = base64.b64decode(page.images[0].split(",", 1)[1])
    image = np.asarray(Image.open(io.BytesIO(data)))
    assert image.shape == (40, 30, 3)
    assert image[20, 5].astype(int) == pytest.approx([200, 40, 40], abs=12)


def test_a_report_of_nothing_is_a_page_too():
    assert "<h1>t</h1>" in build(ReportData("t"))
