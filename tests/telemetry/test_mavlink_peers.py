"""Who becomes the vehicle, who stays a stranger, and whose messages never mix in."""

import pytest

from telemetry.link.peers import FORGET_S, MOST_CANDIDATES, REFUSED_S, TRY_S, Peers, Source
from telemetry.topics.messages import LOST_S, Candidate
from tests.telemetry.frames import attitude, ground_station_heartbeat, heard, heartbeat

UDP = "udpin:0.0.0.0:14550"
HERE = Source(UDP, "10.0.0.2:4000", 1, 1)


def at(peer: str = "10.0.0.2:4000", *, address: str = UDP, system: int = 1, component: int = 1) -> Source:
    return Source(address, peer, system, component)


def adopted(now_s: float = 0.0) -> Peers:
    return adopted_at(HERE, now_s)


def adopted_at(source: Source, now_s: float = 0.0) -> Peers:
    peers = Peers()
    peers.hear(source, heard(heartbeat()), now_s)
    candidate = peers.find(source.id, now_s)
    assert candidate is not None
    peers.adopt(candidate, now_s)
    return peers


def test_an_autopilots_heartbeat_makes_a_candidate() -> None:
    peers = Peers()
    assert peers.hear(HERE, heard(attitude()), 0.0) == "stranger"
    assert peers.candidates(0.0) == ()
    assert peers.hear(HERE, heard(heartbeat()), 0.0) == "stranger"
    (candidate,) = peers.candidates(0.0)
    assert (candidate.id, candidate.autopilot) == ("udpin:0.0.0.0:14550/10.0.0.2:4000/1/1", "ardupilot")


@pytest.mark.fact("A25")
def test_another_ground_station_never_counts_as_a_vehicle() -> None:
    peers = Peers()
    peers.adopt_first_of(UDP, wanted=True)
    message = heard(ground_station_heartbeat())
    peers.hear(HERE, message, 0.0)
    assert not peers.wants(HERE, message)
    assert peers.candidates(0.0) == ()


def test_the_first_autopilot_is_wanted_where_that_was_asked_for() -> None:
    peers, message = Peers(), heard(heartbeat())
    assert not peers.wants(HERE, message)
    peers.adopt_first_of(UDP, wanted=True)
    assert peers.wants(HERE, message)
    assert not peers.wants(at(address="tcp:x:1"), message)


def test_after_a_restart_only_the_vehicle_that_was_there_is_taken_by_itself_from_where_it_was() -> None:
    message, before = heard(heartbeat()), adopted().adopted
    peers = Peers()
    peers.adopt_first_of(UDP, wanted=True, only=before)
    assert peers.wants(HERE, message)
    assert not peers.wants(at(system=7), message)
    assert not peers.wants(at("10.0.0.2:4001"), message)
    called = "tcpin:0.0.0.0:5760"
    was = adopted_at(at("10.0.0.2:4000", address=called)).adopted
    peers.adopt_first_of(called, wanted=True, only=was)
    assert peers.wants(at("10.0.0.2:4001", address=called), message)
    assert not peers.wants(at("10.0.0.9:4000", address=called), message)


def test_what_was_released_is_not_adopted_again_by_itself() -> None:
    peers = Peers()
    peers.adopt_first_of(UDP, wanted=True)
    message = heard(heartbeat())
    peers.hear(HERE, message, 0.0)
    candidate = peers.find(HERE.id, 0.0)
    assert candidate is not None
    peers.adopt(candidate, 0.0)
    assert not peers.wants(HERE, message)
    peers.release()
    assert not peers.wants(HERE, message)
    assert peers.candidates(0.0) == (candidate,)


def test_candidates_are_forgotten_and_bounded() -> None:
    peers = Peers()
    for k in range(3 * MOST_CANDIDATES):
        peers.hear(at(f"10.0.0.2:{k}", system=1 + k % 250), heard(heartbeat()), 0.0)
    assert len(peers.candidates(0.0)) == MOST_CANDIDATES
    assert peers.candidates(FORGET_S) == ()


def test_messages_of_the_vehicles_other_components_are_its_own() -> None:
    assert adopted().hear(at(component=154), heard(attitude(), component=154), 0.1) == "adopted"


def test_a_second_vehicle_with_the_same_id_does_not_mix_in_and_is_warned_of() -> None:
    peers = adopted()
    twin = at("10.0.0.9:4000")
    assert peers.hear(twin, heard(attitude()), 1.0) == "imposter"
    assert peers.hear(twin, heard(heartbeat()), 1.0) == "stranger"
    (warning,) = peers.warnings(1.0)
    assert "system id 1" in warning
    assert "10.0.0.9:4000" in warning
    assert peers.adopted is not None
    assert peers.adopted.peer == HERE.peer
    assert [candidate.peer for candidate in peers.candidates(1.0)] == ["10.0.0.9:4000"]
    assert peers.warnings(20.0) == ()


@pytest.mark.fact("P20")
def test_a_vehicle_with_another_id_is_a_candidate_without_a_warning() -> None:
    peers = adopted()
    assert peers.hear(at(system=2), heard(heartbeat(), system=2), 1.0) == "stranger"
    assert len(peers.candidates(1.0)) == 1
    assert peers.warnings(1.0) == ()


@pytest.mark.parametrize("peer", ["10.0.0.2:4001", "10.0.0.9:4000"])
def test_a_vehicle_that_was_lost_is_taken_up_from_elsewhere_by_the_operator_only(peer: str) -> None:
    peers, elsewhere = adopted(), at(peer)
    assert peers.hear(elsewhere, heard(heartbeat()), 1.0) == "stranger"
    assert peers.again(1.0) is None
    for now_s in (5.0, 6.0, 7.0):
        assert peers.hear(elsewhere, heard(heartbeat()), now_s) == "stranger"
        assert peers.hear(elsewhere, heard(attitude()), now_s) == "imposter"
    assert peers.adopted is not None
    assert peers.adopted.peer == HERE.peer
    again = peers.again(7.0)
    assert again is not None
    assert again.peer == peer
    assert peers.warnings(7.0) == ()
    peers.adopt(again, 7.0)
    assert peers.hear(HERE, heard(attitude()), 7.1) == "imposter"
    assert peers.again(7.1) is None


def test_a_vehicle_that_is_heard_again_is_not_asked_for() -> None:
    peers = adopted()
    peers.hear(at("10.0.0.2:4001"), heard(heartbeat()), 5.0)
    assert peers.again(5.0) is not None
    peers.hear(HERE, heard(heartbeat()), 5.1)
    assert peers.again(5.2) is None


def test_another_number_is_another_vehicle() -> None:
    peers = adopted()
    peers.hear(at(system=2), heard(heartbeat(), system=2), 9.0)
    assert peers.again(9.0) is None


def test_after_hanging_up_it_is_asked_for_at_once() -> None:
    peers = adopted()
    peers.gone(UDP, HERE.peer)
    assert peers.hear(at("10.0.0.2:4001"), heard(heartbeat()), 0.1) == "stranger"
    assert peers.again(0.1) is not None


TCP = "tcp:10.0.0.7:5760"
THERE = at("10.0.0.7:5760", address=TCP)


def with_a_way() -> Peers:
    peers = adopted()
    peers.take_as_way(TCP)
    return peers


def asked(peers: Peers, source: Source, now_s: float) -> Candidate:
    peers.hear(source, heard(heartbeat()), now_s)
    assert peers.may_join(source, heard(heartbeat()), now_s)
    candidate = peers.find(source.id, now_s)
    assert candidate is not None
    peers.ask(candidate, now_s)
    return candidate


def test_only_on_a_connection_that_is_named_as_a_way_may_its_numbers_be_the_vehicle() -> None:
    peers = with_a_way()
    message = heard(heartbeat())
    assert peers.may_join(THERE, message, 0.1)
    assert not peers.may_join(at(address="tcp:10.0.0.8:5760"), message, 0.1)
    assert not peers.may_join(at("10.0.0.7:5760", address=TCP, system=2), message, 0.1)
    assert not peers.may_join(THERE, heard(heartbeat(kind=13)), 0.1), "another kind of vehicle"
    assert not peers.may_join(THERE, heard(attitude()), 0.1)
    assert not peers.may_join(at("10.0.0.9:4000"), message, 0.1), "the vehicle itself is there"


def test_who_is_asked_is_neither_vehicle_nor_imposter_until_it_is_known() -> None:
    peers = with_a_way()
    candidate = asked(peers, THERE, 0.1)
    assert peers.warnings(0.2) == (), "no second vehicle"
    assert peers.hear(THERE, heard(attitude()), 0.2) == "asked"
    assert (peers.places, peers.place_at(TCP)) == ((peers.adopted,), candidate)
    peers.know(TCP)
    assert peers.hear(THERE, heard(attitude()), 0.3) == "adopted"
    assert peers.places == (peers.adopted, candidate)
    assert candidate not in peers.candidates(0.3)
    assert not peers.may_join(at("10.0.0.7:5761", address=TCP), heard(heartbeat()), 0.4)


def test_who_turned_out_to_be_another_vehicle_is_not_asked_again_for_a_while() -> None:
    peers = with_a_way()
    candidate = asked(peers, THERE, 0.1)
    peers.part(TCP, 0.2, refused=True)
    assert peers.hear(THERE, heard(heartbeat()), 0.2) == "stranger"
    assert not peers.may_join(THERE, heard(heartbeat()), 0.2)
    assert candidate in peers.candidates(0.2)
    assert peers.warnings(0.2) != ()
    later_s = 0.2 + REFUSED_S
    peers.hear(HERE, heard(heartbeat()), later_s)
    assert not peers.may_join(THERE, heard(heartbeat()), later_s - 0.1)
    assert peers.may_join(THERE, heard(heartbeat()), later_s)
    peers.hear(HERE, heard(heartbeat()), 0.3)
    peers.forget(TCP)
    peers.take_as_way(TCP)
    assert peers.may_join(THERE, heard(heartbeat()), 0.3), "the connection was made anew"


def test_who_never_answers_makes_room_for_the_next() -> None:
    peers = with_a_way()
    asked(peers, THERE, 0.1)
    next_one = at("10.0.0.7:5761", address=TCP)
    for now_s in (1.0, 2.0, TRY_S + 0.5):
        peers.hear(HERE, heard(heartbeat()), now_s)
        peers.hear(THERE, heard(heartbeat()), now_s)
        assert peers.may_join(next_one, heard(heartbeat()), now_s) is (now_s > TRY_S)


def test_a_way_that_was_lost_may_come_back_from_another_port_while_the_vehicle_is_heard_elsewhere() -> None:
    peers = with_a_way()
    asked(peers, THERE, 0.1)
    peers.know(TCP)
    again = at("10.0.0.2:4001")
    now_s = LOST_S + 1.0
    peers.hear(THERE, heard(heartbeat()), now_s)
    assert peers.may_join(again, heard(heartbeat()), now_s), "the first one is a way as well"
    later_s = 2 * now_s + LOST_S
    peers.hear(again, heard(heartbeat()), later_s)
    assert not peers.may_join(again, heard(heartbeat()), later_s), "nothing to compare it with"
    assert peers.again(later_s) is not None, "now the operator decides"


def test_while_one_way_is_heard_nobody_is_asked_whether_that_is_it() -> None:
    peers = with_a_way()
    asked(peers, THERE, 0.1)
    peers.know(TCP)
    assert peers.gone(UDP, HERE.peer)
    assert not peers.gone(UDP, "10.0.0.9:1")
    peers.hear(at("10.0.0.2:4001"), heard(heartbeat()), 0.2)
    assert peers.again(0.2) is None
    assert peers.gone(TCP, THERE.peer)
    assert peers.again(0.3) is not None


def test_when_the_connection_goes_where_it_was_adopted_it_is_the_one_at_the_next_place() -> None:
    peers = with_a_way()
    candidate = asked(peers, THERE, 0.1)
    peers.know(TCP)
    peers.forget(UDP)
    assert (peers.adopted, peers.places) == (candidate, (candidate,))


def test_a_release_forgets_all_places() -> None:
    peers = with_a_way()
    for address in (TCP, "tcp:10.0.0.9:5760"):
        peers.adopt_first_of(address, wanted=True)
    asked(peers, THERE, 0.1)
    peers.know(TCP)
    peers.release()
    assert not peers.adopts_first_of("tcp:10.0.0.9:5760"), "nobody was heard there yet"
    assert (peers.places, peers.adopted) == ((), None)
    assert not peers.wants(THERE, heard(heartbeat()))
    assert not peers.may_join(THERE, heard(heartbeat()), 0.2)
    assert peers.is_as_way(TCP)
