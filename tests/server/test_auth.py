"""Links work once, sessions survive a restart and end, passwords cannot be guessed quickly."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from server.door.auth import TRIES_MAX, Auth, session_key
from server.errors import SignInError, TooManyTriesError
from server.settings import PasswordHash


class Clock:
    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def auth(tmp_path: Path, clock: Clock) -> Auth:
    return Auth(tmp_path / "sessions.json", password=PasswordHash.of("long enough"), clock_utc_s=clock)


def test_a_link_signs_in_once(auth: Auth) -> None:
    token = auth.new_link_token()
    with pytest.raises(SignInError, match="newest"):
        auth.redeem(token + "x")
    session = auth.redeem(token)
    assert auth.remaining_s(session) == auth.lifetime_s
    with pytest.raises(SignInError, match="used already"):
        auth.redeem(token)


def test_only_the_newest_link_counts(auth: Auth) -> None:
    old = auth.new_link_token()
    auth.new_link_token()
    with pytest.raises(SignInError):
        auth.redeem(old)


@pytest.mark.parametrize("session_id", ["", "x", "\udcff", "a" * 10_000])
def test_an_invented_session_is_none(auth: Auth, session_id: str) -> None:
    assert auth.remaining_s(session_id) == 0


def test_sessions_survive_a_restart_but_their_file_signs_nobody_in(auth: Auth, tmp_path: Path, clock: Clock) -> None:
    session = auth.sign_in("long enough")
    file = tmp_path / "sessions.json"
    assert Auth(file, clock_utc_s=clock).remaining_s(session) > 0
    assert session not in file.read_text()
    assert list(json.loads(file.read_text())) == [session_key(session)]
    assert auth.remaining_s(session_key(session)) == 0
    assert file.stat().st_mode & 0o077 == 0


def test_sessions_end(auth: Auth, clock: Clock) -> None:
    first, second = auth.sign_in("long enough"), auth.sign_in("long enough")
    auth.sign_out(first)
    assert (auth.remaining_s(first), auth.remaining_s(second)) == (0, auth.lifetime_s)
    clock.now += auth.lifetime_s
    assert auth.remaining_s(second) == 0


def test_five_wrong_passwords_close_the_door_for_a_minute(auth: Auth, clock: Clock) -> None:
    for _ in range(TRIES_MAX):
        with pytest.raises(SignInError, match="wrong"):
            auth.sign_in("guess")
    with pytest.raises(TooManyTriesError):
        auth.sign_in("long enough")
    clock.now += 61
    assert auth.remaining_s(auth.sign_in("long enough")) > 0


def test_without_a_password_none_is_right(tmp_path: Path) -> None:
    with pytest.raises(SignInError, match="No password"):
        Auth(tmp_path / "s.json").sign_in("")


@pytest.mark.parametrize("content", ["", "[]", '{"a": "b"}', "\x00"])
def test_a_damaged_file_costs_a_sign_in_only(tmp_path: Path, content: str) -> None:
    file = tmp_path / "sessions.json"
    file.write_text(content)
    auth = Auth(file)
    assert auth.remaining_s(auth.redeem(auth.new_link_token())) > 0
