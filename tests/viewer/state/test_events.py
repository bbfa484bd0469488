from __future__ import annotations

import json
from pathlib import Path

import pytest

from toolkit.errors import InputError
from viewer.script import Player, Recorder
from viewer.state.events import Command, Hit, Key, PanelInput, Pointer, TimelineInput, event_from, event_to

EVENTS = [
    Key("z", ("shift",)),
    Pointer(
        "press", 1, "left", ("alt",), (1.0, 2.0, 3.0), (0.0, 0.0, -1.0), Hit(4, (0.2, 0.3, 0.5), 7, (0.1, 0.2, 0.3))
    ),
    Pointer("drag", 0, "right", moved=(0.1, -0.2), travel=0.3),
    PanelInput("light:azimuth", 12.5, False),
    TimelineInput("first", 12, "release"),
    Command("mode", "pose"),
]


@pytest.mark.parametrize("event", EVENTS)
def test_events_survive_json(event) -> None:
    assert event_from(json.loads(json.dumps(event_to(event)))) == event


def test_what_is_no_event_is_refused() -> None:
    with pytest.raises(InputError, match="no event 'shout'"):
        event_from({"event": "shout"})
    with pytest.raises(InputError, match="cannot be read"):
        event_from({"event": "key", "nome": "z"})


class Quiet:
    """As much of an application as the player looks at."""

    busy = False


def test_what_was_recorded_is_played_again(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "events.jsonl")
    for event in EVENTS:
        recorder.write(event)
    recorder.write(Pointer("hover", 0))
    player, played = Player(tmp_path / "events.jsonl"), []
    while not player.finished:
        player.play(played.append, Quiet)
    assert played == EVENTS


def test_a_script_waits_for_long_work_but_not_to_cancel_it(tmp_path: Path) -> None:
    script = tmp_path / "events.jsonl"
    script.write_text('# a comment\n{"event": "command", "name": "cancel"}\n{"event": "key", "name": "f"}\n')
    player, played = Player(script), []

    class Busy(Quiet):
        busy = True

    player.play(played.append, Busy)
    player.play(played.append, Busy)
    assert [event.name for event in played] == ["cancel"]
    player.play(played.append, Quiet)
    assert [event.name for event in played] == ["cancel", "f"]


def test_a_torn_script_is_refused_with_its_line(tmp_path: Path) -> None:
    script = tmp_path / "events.jsonl"
    script.write_text('{"event": "key", "name": "f"}\n{"event": \n')
    with pytest.raises(InputError, match="line 2 is no JSON"):
        Player(script)
