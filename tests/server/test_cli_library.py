"""``hedgehop library`` on the command line: answers, exit codes, what is said when it ends early."""

from __future__ import annotations

from pathlib import Path

import pytest

from server.cli.library import commands
from server.cli.library.sharing_words import Telling
from server.library.sharing.outcome import Done, Outcome
from tests.server.cli_runs import hedgehop
from tests.server.sharing_library import add_recording, closed_mcap, full_library, shared_files, write_plan


@pytest.fixture
def stick(tmp_path: Path) -> Path:
    (tmp_path / "stick").mkdir()
    return tmp_path / "stick"


def test_there_and_back(tmp_path: Path, stick: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    full_library(one)
    would = hedgehop("library", "push", stick, "--data-dir", one, "--dry-run")
    assert (would.code, would.err) == (0, "")
    assert "Would send: plan Slope" in would.out
    assert list(stick.iterdir()) == []
    sent = hedgehop("library", "push", stick, "--data-dir", one, "--json")
    assert (sent.code, sent.err) == (0, "")
    assert sent.json["target"] == str(stick)
    assert len(sent.json["done"]) == 7
    assert sent.json["left_out"] == []
    held = hedgehop("library", "list", stick, "--json")
    assert held.code == 0
    assert sorted(item["title"] for item in held.json["items"]) == sorted(each["title"] for each in sent.json["done"])
    assert "recording" in hedgehop("library", "list", stick).out
    brought = hedgehop("library", "pull", stick, "--data-dir", two)
    assert brought.code == 0
    assert brought.out.splitlines()[-1].startswith("Brought 7 things")
    assert shared_files(two) == shared_files(one)
    again = hedgehop("library", "pull", stick, "--data-dir", two)
    assert again.out == "Brought 0 things, 0.00 MB over the line; 7 already here, 0 left out.\n"


def test_what_is_left_out_is_said_and_the_exit_code_tells(tmp_path: Path, stick: Path) -> None:
    one = tmp_path / "one"
    add_recording(one, "now.mcap", closed_mcap(b"flying")[:-1])
    write_plan(one, "Pl\x1b[31man")
    sent = hedgehop("library", "push", stick, "--data-dir", one)
    assert sent.code == 1
    assert "Left out: recordings/now.mcap: This recording is being written, or broke off." in sent.err
    assert "Sent 1 things" in sent.out
    assert "\x1b" not in sent.out + hedgehop("library", "list", stick).out
    (blob,) = [path for path in (stick / "hedgehop-library-1" / "blobs").rglob("*") if path.is_file()]
    blob.write_bytes(b"x" * blob.stat().st_size)
    brought = hedgehop("library", "pull", stick, "--data-dir", tmp_path / "two", "--json")
    assert brought.code == 1
    assert blob.name in brought.json["left_out"][0]["what"]
    blob.unlink()
    held = hedgehop("library", "list", stick)
    assert held.code == 1
    assert "1 blobs missing or torn" in held.out


def test_wrong_targets(tmp_path: Path, stick: Path) -> None:
    for arguments in (("push", tmp_path / "no"), ("pull", stick), ("list", stick), ("push", "s3://a:b@c/d")):
        run = hedgehop("library", *arguments, "--json")
        assert run.code == 2
        assert run.json["error"]["code"] == "target"
        assert run.json["error"]["advice"]
    run = hedgehop("library", "push", stick, "--data-dir", tmp_path / "nowhere", "--json")
    assert (run.code, run.json["error"]["code"]) == (2, "data_dir")


def test_ctrl_c_says_what_is_done(tmp_path: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(root: Path, target: object, outcome: Outcome, tell: object, **options: object) -> None:
        outcome.done.append(Done("plan", "abc", "Slope", 1000))
        outcome.moved_bytes = 1000
        raise KeyboardInterrupt

    monkeypatch.setattr(commands, "push_library", interrupted)
    run = hedgehop("library", "push", stick, "--data-dir", tmp_path)
    assert run.code == 1
    assert "Stopped by Ctrl-C. Run the command again: it goes on." in run.err
    assert "Sent: plan Slope" in run.out


def test_progress_is_shown_from_half_a_second_on(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s, told = [0.0], []
    monkeypatch.setattr("time.monotonic", lambda: now_s[0])
    monkeypatch.setattr("server.cli.library.sharing_words.progress", lambda step, share: told.append((step, share)))
    telling = Telling()
    for now_s[0] in (0.1, 0.4, 0.6, 0.61, 0.8):
        telling.tell("Sending", now_s[0])
    assert told == [("Sending", 0.6), ("Sending", 0.8)]
