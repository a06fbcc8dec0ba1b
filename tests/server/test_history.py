"""Undo and redo over whole documents."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.library.history import History
from server.schemas import PlanDoc, PoiDoc


def named(name: str) -> PlanDoc:
    return PlanDoc(name=name)


def edited(*names: str) -> History:
    history = History()
    for name in names:
        history.edit(f"to {name}", named(name), coalesce=False, now_mono_s=0.0)
    return history


def test_a_new_history_has_nothing_to_undo() -> None:
    history = History()
    assert (history.can_undo, history.can_redo, history.undo(), history.redo()) == (False, False, False, False)
    assert (history.undo_label, history.redo_label) == ("", "")


def test_an_edit_after_undo_drops_what_was_undone() -> None:
    history = edited("a", "b")
    history.undo()
    history.edit("to c", named("c"), coalesce=False, now_mono_s=1.0)
    assert (history.present.name, history.undo_label, history.can_redo) == ("c", "to c", False)
    history.undo()
    assert history.present.name == "a"


def test_an_edit_without_a_label_can_be_undone() -> None:
    history = History()
    history.edit("", named("a"), coalesce=False, now_mono_s=0.0)
    assert history.can_undo
    assert history.undo()
    assert history.can_redo


def test_a_drag_is_one_step() -> None:
    history = edited("a")
    for step, at_s in enumerate((10.0, 11.0, 12.5)):
        history.edit("Radius", named(f"r{step}"), coalesce=True, now_mono_s=at_s)
    assert history.present.name == "r2"
    history.undo()
    assert history.present.name == "a"


@pytest.mark.parametrize(("label", "at_s"), [("Radius", 12.1), ("Height", 10.5)])
def test_a_pause_or_another_control_begins_a_new_step(label: str, at_s: float) -> None:
    history = edited("a")
    history.edit("Radius", named("r0"), coalesce=True, now_mono_s=10.0)
    history.edit(label, named("r1"), coalesce=True, now_mono_s=at_s)
    history.undo()
    assert history.present.name == "r0"


def test_a_drag_after_undo_does_not_rewrite_the_past() -> None:
    history = edited("a")
    history.edit("Radius", named("r0"), coalesce=True, now_mono_s=10.0)
    history.edit("Radius", named("r1"), coalesce=False, now_mono_s=10.1)
    history.undo()
    history.edit("Radius", named("r2"), coalesce=True, now_mono_s=10.2)
    history.undo()
    assert history.present.name == "r0"


def test_old_steps_are_forgotten_sooner_when_they_are_large() -> None:
    small = edited(*(f"n{i}" for i in range(130)))
    assert (len(small.labels), small.present.name) == (100, "n129")
    pois = [PoiDoc(id=f"p{i}", lat_deg=1, lon_deg=2) for i in range(5000)]
    large = History()
    for i in range(30):
        large.edit("x", PlanDoc(name=f"n{i}", pois=pois), coalesce=False, now_mono_s=0.0)
    assert (len(large.labels), large.present.name, large.can_redo) == (10, "n29", False)


@given(st.lists(st.sampled_from(["edit", "drag", "undo", "redo"]), max_size=40))
def test_whatever_happens_the_record_comes_back_from_disk(steps: list[str]) -> None:
    history = History()
    for number, step in enumerate(steps):
        if step in ("edit", "drag"):
            history.edit("x", named(f"n{number}"), coalesce=step == "drag", now_mono_s=number * 0.5)
        else:
            getattr(history, step)()
    back = History.from_json(json.loads(json.dumps(history.to_json())))
    assert (back.documents, back.labels, back.position) == (history.documents, history.labels, history.position)
    assert len(history.documents) == len(history.labels) + 1
    before = history.present
    if history.undo():
        assert history.redo()
        assert history.present == before


@pytest.mark.parametrize(
    "change",
    [
        {"position": 5},
        {"position": -1},
        {"labels": []},
        {"documents": []},
        {"documents": "x"},
        {"position": None},
        {"documents": [{}, {"nonsense": 1}]},
    ],
)
def test_a_record_that_contradicts_itself_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"history|nonsense"):
        History.from_json({**edited("a").to_json(), **change})
