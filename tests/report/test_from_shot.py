from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

import pytest

from toolkit.report.from_shot import result_links
from toolkit.shot import Shot


@pytest.mark.parametrize("place", [".", "..", "../of all", "render"])
def test_links_lead_from_the_report_to_the_files(tmp_path: Path, place: str) -> None:
    folder = tmp_path / "take 3 #a"
    for name in ("result/frames.npy", "export/face.glb", "render/contact_sheet.png"):
        (folder / name).parent.mkdir(parents=True)
        (folder / name).touch()
    (folder / "shot.toml").write_text('[source]\nreference="a.obj"\nframes="a.npy"\n[target]\nreference="b.obj"\n')
    (tmp_path / "of all").mkdir()
    links = result_links(Shot(folder), folder / place)
    assert [text for text, _ in links] == ["result/frames.npy", "export/face.glb", "render/contact_sheet.png"]
    for text, address in links:
        assert (folder / place / unquote(address)).resolve() == folder / text
        assert "#" not in address
