"""``hedgehop risk`` on the demo terrain."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.server.cli_runs import hedgehop, write_demo

pytestmark = pytest.mark.xdist_group("risk")


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("inputs")
    model, points = write_demo(folder)
    run = hedgehop("plan", model, points, "--out", folder / "flight", "--profile", "mapper-rtk", "--height-m", 4)
    assert (folder / "flight" / "mission.plan").exists(), run.err
    return model, folder / "flight" / "mission.plan"


def test_it_says_that_it_is_no_proof(planned: tuple[Path, Path]) -> None:
    run = hedgehop("risk", *planned, "--flights", 150)
    assert run.code == 0
    assert run.out.startswith("An estimate under assumed errors, not a proof: it loosens no certificate")
    assert "contact: none on 150 flights; with 95 % confidence at most 2 % of flights touch it" in run.out
    assert "random: following the line, 1.10 m at 3 standard deviations, alike over 15 m" in run.out


def test_larger_errors_touch_and_the_certificate_stays_as_it_is(planned: tuple[Path, Path]) -> None:
    run = hedgehop("risk", *planned, "--flights", 150, "--following-m", 9, "--json")
    proof = hedgehop("certify", *planned, "--following-m", 9, "--json")
    assert (run.code, proof.code) == (0, 1)
    found = run.json
    assert found["is_proof"] is False
    assert found["certified"] is proof.json["certified"] is False
    contact = found["contact"]
    assert 0 < contact["low"] < contact["estimate"] < contact["high"] <= 1
    assert contact["hits"] == round(contact["estimate"] * 150)
    assert found["worst"]["contacts"] > 0
    assert found["nearest_hull_m"] < 0
    assert "NOT CERTIFIED" in hedgehop("risk", *planned, "--flights", 10, "--following-m", 9).out


def test_on_workers_it_is_the_same_answer(planned: tuple[Path, Path]) -> None:
    pytest.importorskip("distributed")
    asked = ("risk", *planned, "--flights", 250, "--seed", 4, "--correlation-m", "position_error=inf", "--json")
    here, spread = hedgehop(*asked), hedgehop(*asked, "--cluster", "local:2")
    assert here.out == spread.out
    assert here.json["contact"]["flights"] == 250
    assert [each["correlation_m"] for each in here.json["errors"] if each["code"] == "position_error"] == [None]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--flights", "0"), "flights"),
        (("--confidence", "1"), "--confidence"),
        (("--sigmas", "0"), "--sigmas"),
        (("--correlation-m", "wind=3"), "sets no length"),
        (("--correlation-m", "following=far"), "sets no length"),
        (("--correlation-m", "following=nan"), "sets no length"),
        (("--correlation-m", "following=0"), "cannot be alike"),
        (("--cluster", "dask"), "names no cluster"),
    ],
)
def test_what_cannot_be_done_is_said(planned: tuple[Path, Path], arguments: tuple[str, ...], words: str) -> None:
    run = hedgehop("risk", *planned, *arguments)
    assert run.code == 2
    assert words in run.err
