"""What uploads promise on a bad link: loss, reordering, cuts at any message, a lost last acknowledgement, cost."""

from __future__ import annotations

import random
import statistics
from typing import Any

import pytest

from telemetry.errors import SilentError, TransferError
from telemetry.mavlink.actions import Done, Failed
from telemetry.mavlink.items import item_from_message
from telemetry.mavlink.verify import as_stored, digest
from telemetry.topics.onboard_lists import UploadReport
from tests.seeds import seeds
from tests.telemetry.lossy import Faults
from tests.telemetry.mission_samples import HARSH, VEHICLES, WORSE, mission, upload
from tests.telemetry.mission_vehicles import ArduCopter


@pytest.mark.parametrize("vehicle", VEHICLES)
@seeds(50)
def test_at_30_percent_loss_every_upload_succeeds(vehicle: type, seed: int) -> None:
    items = mission(100, seed=seed)
    craft = vehicle()
    run = upload(items, craft, HARSH, seed=seed)
    assert run.result.verified
    assert run.result.differences == ()
    assert craft.completed >= 1
    assert run.now_s <= 60.0


@pytest.mark.fact("A15")
@pytest.mark.parametrize(
    ("faults", "measured_s"),
    [
        (Faults(loss=0.1), 4.9),
        (Faults(loss=0.3), 20.3),
        (Faults(loss=0.3, reordering=0.05, duplicates=0.05, late_s=0.25), 20.8),
    ],
    ids=["10 %", "30 %", "30 %, reordered, twice"],
)
def test_all_of_15_uploads_of_100_items_succeed_as_they_did_to_a_real_vehicle(
    faults: Faults, measured_s: float
) -> None:
    """And none is said to have failed that is on board. The median may be twice the one of the real autopilot."""
    runs = [upload(mission(100, seed=seed), ArduCopter(), faults, seed=seed) for seed in range(15)]
    assert [run.result.verified for run in runs] == [True] * 15
    assert statistics.median(run.now_s for run in runs) < 2 * measured_s


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_at_50_percent_loss_49_of_50_succeed(vehicle: type) -> None:
    ends = [upload(mission(50, seed=seed), vehicle(), WORSE, seed=seed).end for seed in range(50)]
    results = [end.result for end in ends if isinstance(end, Done)]
    assert sum(isinstance(result, UploadReport) and result.verified for result in results) >= 49


@pytest.mark.fact("A16")
@pytest.mark.parametrize("vehicle", VEHICLES)
def test_a_cut_link_never_looks_like_success(vehicle: type) -> None:
    """The link dies at any message, in both directions or in one: 1,000 cuts over both kinds of vehicle."""
    rng = random.Random(7)
    items, before = mission(8), mission(6, seed=9)
    whole = upload(items, loaded(vehicle, before)).sent
    false_successes = silent = 0
    for _ in range(500):
        at, way = rng.randrange(whole - 1), rng.choice(("up", "down", "both"))

        def cut(direction: str, _: Any, number: int, at: int = at, way: str = way) -> bool:
            return number >= at and way in (direction, "both")

        faults = Faults(loss=rng.choice((0.0, 0.2)))
        run = upload(items, loaded(vehicle, before), faults, seed=rng.randrange(10**6), lose=cut)
        holds_it = digest_of(run.vehicle) == digest(as_stored(items, "ardupilot" if vehicle is ArduCopter else "px4"))
        false_successes += isinstance(run.end, Done) and not (run.result.verified and holds_it)
        silent += isinstance(run.end, Failed) and isinstance(run.error, SilentError | TransferError)
    assert false_successes == 0
    assert silent > 400


def loaded(vehicle: type, items: tuple[Any, ...]) -> Any:
    """A vehicle that holds another mission."""
    craft = vehicle()
    upload(items, craft)
    return craft


def digest_of(craft: Any) -> str:
    rows = craft.stored[1:] if isinstance(craft, ArduCopter) else craft.stored
    return digest(tuple(item_from_message(row) for row in rows))


@pytest.mark.fact("A17")
@pytest.mark.parametrize("vehicle", VEHICLES)
@seeds(50)
def test_a_lost_last_acknowledgement_is_settled_by_reading_back(vehicle: type, seed: int) -> None:
    def lose(direction: str, message: Any, _: int) -> bool:
        return direction == "down" and message.get_type() == "MISSION_ACK" and message.type == 0

    items = mission(10 + seed)
    run = upload(items, vehicle(), Faults(loss=0.05), seed=seed, lose=lose)
    assert run.result.verified


@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize(("latency_s", "most"), [(0.25, 310), (0.45, 430)])
def test_a_slow_radio_is_not_filled_with_repetitions(vehicle: type, latency_s: float, most: int) -> None:
    """PX4 itself asks again every quarter of a second, whatever is on its way."""
    items = mission(100)
    run = upload(items, vehicle(), Faults(latency_s=latency_s))
    assert run.result.verified
    kinds = ("MISSION_ITEM_INT", "MISSION_REQUEST_INT", "MISSION_REQUEST_LIST")
    sent = [message for _, way, message in run.log if way == "up" and message.get_type() in kinds]
    assert len(sent) <= most


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_a_slow_radio_that_loses_a_third_is_got_through_too(vehicle: type) -> None:
    items = mission(50)
    run = upload(items, vehicle(), Faults(loss=0.15, latency_s=0.25))
    assert run.result.verified


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_650_items_cost_at_most_1_3_times_one_request_and_response_per_item(vehicle: type) -> None:
    count = 649 if vehicle is ArduCopter else 500
    latency_s = 0.03
    run = upload(mission(count), vehicle(), Faults(latency_s=latency_s))
    assert run.result.verified
    assert run.result.seconds <= 1.3 * count * 2 * latency_s
