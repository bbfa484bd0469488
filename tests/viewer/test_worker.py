from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from toolkit.errors import InputError
from viewer.worker import Cancelled, Task, Worker


@pytest.fixture
def worker() -> Iterator[Worker]:
    made = Worker()
    yield made
    made.stop()


def test_results_come_on_the_callers_thread_in_order(worker: Worker) -> None:
    got: list[tuple[int, str]] = []
    for k in range(5):
        worker.submit(
            Task(f"{k}", lambda progress, k=k: k * k, lambda r: got.append((r, threading.current_thread().name)))
        )
    assert worker.busy
    worker.wait()
    assert got == [(k * k, threading.main_thread().name) for k in range(5)]
    assert not worker.busy


def test_of_a_slot_only_the_newest_is_done(worker: Worker) -> None:
    hold, done = threading.Event(), []
    worker.submit(Task("first", lambda progress: hold.wait(5), lambda r: done.append("first"), slot="drag"))
    time.sleep(0.05)
    for k in range(10):
        worker.submit(Task(f"{k}", lambda progress, k=k: k, done.append, slot="drag"))
    hold.set()
    worker.wait()
    assert done == ["first", 9]


def test_cancel_stops_what_reports_progress_and_drops_what_waits(worker: Worker) -> None:
    began, failed, done = threading.Event(), [], []

    def long(progress) -> None:
        for k in range(10_000):
            progress("counting", k, 10_000)
            began.set()
            time.sleep(0.001)

    worker.submit(Task("long", long, done.append, failed.append))
    worker.submit(Task("after", lambda progress: 1, done.append))
    assert began.wait(5)
    assert worker.progress is not None
    assert worker.progress[0] == "counting"
    worker.cancel()
    worker.wait(5)
    assert done == []
    assert [type(error) for error in failed] == [Cancelled]


def test_a_failure_is_told_and_the_next_task_still_runs() -> None:
    told: list[str] = []
    worker = Worker(lambda name, error: told.append(f"{name}: {error}"))

    def wrong(progress) -> None:
        raise InputError("no such thing", remedy="make one")

    done: list[int] = []
    worker.submit(Task("wrong", wrong, done.append))
    worker.submit(Task("right", lambda progress: 7, done.append))
    worker.wait()
    worker.stop()
    assert done == [7]
    assert told == ["wrong: no such thing; make one."]
