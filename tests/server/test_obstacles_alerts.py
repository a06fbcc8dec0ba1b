"""Alerts stay until they are over and acknowledged, in either order; a dead node's do not stay for ever."""

from __future__ import annotations

from server.obstacles.alert_list import KEPT_MAX, UNHEARD_S, LatchedAlerts
from tests.server.obstacle_messages import alert, obstacle


def test_an_alert_is_latched_until_over_and_acknowledged() -> None:
    kept = LatchedAlerts()
    assert kept.on_alert(alert(), 0.0)
    assert not kept.on_alert(alert(phase="goes_on"), 1.0)
    kept.on_alert(alert(phase="ends"), 2.0)
    assert [(doc.over, doc.acknowledged) for doc in kept.docs] == [(True, False)]
    kept.acknowledge("radar-1")
    assert kept.docs == []


def test_acknowledged_first_it_stays_until_it_is_over() -> None:
    kept = LatchedAlerts()
    kept.on_alert(alert(), 0.0)
    kept.acknowledge("radar-1")
    assert [(doc.over, doc.acknowledged) for doc in kept.docs] == [(False, True)]
    kept.on_alert(alert(phase="ends"), 1.0)
    assert kept.docs == []


def test_the_last_word_keeps_where_it_was() -> None:
    kept = LatchedAlerts()
    kept.on_alert(alert(obstacle=obstacle(12.0)), 0.0)
    kept.on_alert(alert(phase="goes_on", obstacle=obstacle(8.0)), 1.0)
    kept.on_alert(alert(phase="ends"), 2.0)
    last = kept.docs[0].alert.obstacle
    assert last is not None
    assert last.distance_m == 8.0


def test_all_are_acknowledged_at_once_and_a_gone_one_is_no_error() -> None:
    kept = LatchedAlerts()
    for number in range(3):
        kept.on_alert(alert(f"radar-{number}"), 0.0)
    kept.acknowledge("nobody")
    assert not any(doc.acknowledged for doc in kept.docs)
    kept.acknowledge(None)
    assert all(doc.acknowledged for doc in kept.docs)
    assert [doc.alert.id for doc in kept.docs] == ["radar-2", "radar-1", "radar-0"]


def test_of_too_many_those_that_are_over_go_first() -> None:
    kept = LatchedAlerts()
    for number in range(KEPT_MAX):
        kept.on_alert(alert(f"a{number}"), 0.0)
    kept.on_alert(alert("a5", "ends"), 1.0)
    kept.on_alert(alert("new"), 2.0)
    ids = [doc.alert.id for doc in kept.docs]
    assert len(ids) == KEPT_MAX
    assert "a5" not in ids
    assert ids[0] == "new"


def test_an_end_without_a_beginning_is_not_latched() -> None:
    kept = LatchedAlerts()
    assert not kept.on_alert(alert(phase="ends"), 0.0)
    assert kept.docs == []


def test_what_a_silent_node_said_counts_as_over() -> None:
    kept = LatchedAlerts()
    kept.on_alert(alert("r"), 0.0)
    kept.on_alert(alert("v", sensor="vision"), 0.0)
    assert not kept.give_up("radar", UNHEARD_S)
    assert kept.give_up("radar", UNHEARD_S + 0.1)
    assert {doc.alert.id: doc.over for doc in kept.docs} == {"r": True, "v": False}


def test_what_this_server_says_of_a_node_is_not_over_before_it_is_back() -> None:
    kept = LatchedAlerts()
    kept.on_alert(alert("lost-radar", kind="sensor"), 0.0)
    assert not kept.give_up("radar", 100.0)
