"""Links work once, sessions survive a restart and end with what they rest on, hashes are made anew."""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import argon2
import pytest
from argon2 import PasswordHasher

from server.door import passwords
from server.door.accounts import OWNER, Accounts
from server.door.auth import Auth, session_key
from server.door.passwords import OF_NOBODY, PasswordHash
from server.errors import BadRequestError, ConflictError, NotFoundError, SignInError, StorageError

GOOD, HERE, THERE = "long enough", "192.0.2.1", "198.51.100.7"


class Clock:
    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def make(tmp_path: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Auth]:
    """Its passwords are hashed by the real function, without the tenth of a second that makes guessing dear."""
    monkeypatch.setattr(passwords, "_HASHER", PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))

    def auth(password: str | None = GOOD) -> Auth:
        accounts = Accounts(tmp_path, clock_utc_s=clock)
        return Auth(tmp_path / "sessions.json", accounts, password=password, clock_utc_s=clock)

    return auth


@pytest.fixture
def auth(make: Callable[..., Auth]) -> Auth:
    return make()


def enter(auth: Auth, name: str = OWNER, password: str = GOOD, address: str = HERE) -> str:
    return asyncio.run(auth.sign_in(name, password, address))


def lasts(auth: Auth, session_id: str) -> bool:
    return auth.identity(session_id) is not None


def test_a_link_signs_in_once(auth: Auth) -> None:
    token = auth.new_link_token()
    with pytest.raises(SignInError, match="newest"):
        auth.redeem(token + "x")
    identity = auth.identity(auth.redeem(token))
    assert identity is not None
    assert (identity.role, identity.is_owner, identity.remaining_s) == ("operator", True, auth.lifetime_s)
    with pytest.raises(SignInError, match="used already"):
        auth.redeem(token)


def test_only_the_newest_link_counts(auth: Auth) -> None:
    old = auth.new_link_token()
    auth.new_link_token()
    with pytest.raises(SignInError):
        auth.redeem(old)


@pytest.mark.parametrize("session_id", ["", "x", "\udcff", "a" * 10_000])
def test_an_invented_session_is_none(auth: Auth, session_id: str) -> None:
    assert not lasts(auth, session_id)


def test_sessions_survive_a_restart_but_their_file_signs_nobody_in(
    auth: Auth, make: Callable[..., Auth], tmp_path: Path
) -> None:
    session = enter(auth)
    file = tmp_path / "sessions.json"
    assert lasts(make(), session)
    assert session not in file.read_text()
    assert list(json.loads(file.read_text())["sessions"]) == [session_key(session)]
    assert not lasts(auth, session_key(session))
    assert file.stat().st_mode & 0o077 == 0


def test_another_password_in_the_settings_ends_what_the_old_one_let_in(auth: Auth, make: Callable[..., Auth]) -> None:
    by_password, by_link = enter(auth), auth.redeem(auth.new_link_token())
    assert lasts(make(GOOD), by_password)
    for other in ("another one", None):
        assert [lasts(make(other), session) for session in (by_password, by_link)] == [False, True]


def test_sessions_end(auth: Auth, clock: Clock) -> None:
    first, second = enter(auth), enter(auth)
    auth.sign_out([session_key(first)])
    assert (lasts(auth, first), lasts(auth, second)) == (False, True)
    clock.now += auth.lifetime_s
    assert not lasts(auth, second)


def test_an_account_is_invited_chooses_a_password_and_is_removed(auth: Auth, clock: Clock) -> None:
    auth.accounts.add("Anna", "observer")
    with pytest.raises(SignInError, match="wrong"):
        enter(auth, "Anna", "")
    token = auth.accounts.invite("anna")
    invited = auth.redeem(token, THERE)
    identity = auth.identity(invited)
    assert identity is not None
    assert (identity.name, identity.role, identity.is_owner) == ("Anna", "observer", False)
    with pytest.raises(SignInError, match="used already"):
        auth.redeem(token)
    by_other_link = auth.redeem(auth.accounts.invite("Anna"))
    unused = auth.accounts.invite("Anna")
    auth.change_password("Anna", PasswordHash.of("hers alone"), stays=session_key(invited))
    assert (lasts(auth, invited), lasts(auth, by_other_link)) == (True, False)
    with pytest.raises(SignInError):
        auth.redeem(unused)
    by_password = enter(auth, "ANNA", "hers alone")
    late = auth.accounts.invite("Anna", lasts_s=10.0)
    clock.now += 11.0
    with pytest.raises(SignInError, match="expired"):
        auth.redeem(late)
    assert auth.ended([session_key(each) for each in (invited, by_password, "x")]) == {session_key("x")}
    auth.accounts.remove("Anna")
    assert not lasts(auth, invited)
    assert not lasts(auth, by_password)
    with pytest.raises(SignInError):
        enter(auth, "Anna", "hers alone")
    auth.accounts.add("Anna", "operator")
    assert not lasts(auth, by_password)


def test_what_the_command_line_has_written_counts_at_once(auth: Auth, tmp_path: Path, clock: Clock) -> None:
    elsewhere = Accounts(tmp_path, clock_utc_s=clock)
    elsewhere.add("Ben", "operator")
    elsewhere.set_password("Ben", PasswordHash.of("bens own one"))
    session = enter(auth, "Ben", "bens own one")
    assert lasts(auth, session)
    assert lasts(auth, auth.redeem(elsewhere.invite(OWNER)))
    elsewhere.remove("ben")
    assert not lasts(auth, session)


def test_the_file_of_accounts_is_plain_holds_no_secret_and_is_for_this_user_alone(auth: Auth, tmp_path: Path) -> None:
    auth.accounts.add("Anna", "operator")
    token = auth.accounts.invite("Anna")
    auth.accounts.set_password("Anna", PasswordHash.of("hers alone"))
    text = (tmp_path / "accounts.json").read_text()
    assert json.loads(text)["accounts"][0]["name"] == "Anna"
    assert "hers alone" not in text
    assert token not in text
    assert (tmp_path / "accounts.json").stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("name", ["", "   ", "x" * 41, "Owner", "hedgehop", "Link"])
def test_names_that_mislead_are_refused(auth: Auth, name: str) -> None:
    with pytest.raises(BadRequestError):
        auth.accounts.add(name, "operator")


def test_an_account_is_there_once(auth: Auth) -> None:
    assert auth.accounts.add("  A\u202enna\n Berg ", "operator").name == "Anna Berg"
    with pytest.raises(ConflictError, match="already"):
        auth.accounts.add("ANNA berg", "observer")
    for change in (auth.accounts.remove, auth.accounts.invite):
        with pytest.raises(NotFoundError):
            change("Nobody")


@pytest.mark.parametrize("content", ["", "[]", '{"accounts": 1}', "\x00", '{"accounts": [{"name": "x"}]}'])
def test_a_damaged_file_of_accounts_keeps_the_owner_in_and_is_not_overwritten(
    auth: Auth, tmp_path: Path, content: str
) -> None:
    (tmp_path / "accounts.json").write_text(content)
    assert lasts(auth, auth.redeem(auth.new_link_token()))
    with pytest.raises(SignInError):
        enter(auth, "Anna", "hers alone")
    with pytest.raises(StorageError, match="cannot be read"):
        auth.accounts.add("Anna", "operator")
    assert (tmp_path / "accounts.json").read_text() == content


def test_without_a_password_none_is_right(make: Callable[..., Auth]) -> None:
    auth = make(None)
    assert not auth.has_password
    for guess in ("", "x" * 64):
        with pytest.raises(SignInError, match="wrong"):
            enter(auth, OWNER, guess)


@pytest.mark.parametrize("content", ["", "[]", '{"a": 3.5}', '{"sessions": {"a": 3}}', "\x00"])
def test_a_damaged_file_costs_a_sign_in_only(make: Callable[..., Auth], tmp_path: Path, content: str) -> None:
    (tmp_path / "sessions.json").write_text(content)
    auth = make()
    assert lasts(auth, auth.redeem(auth.new_link_token()))


def test_a_hash_is_read_back_as_it_was_written() -> None:
    made = PasswordHash.of("same words")
    assert PasswordHash.read(made.text) == made
    assert made != PasswordHash.of("same words")
    assert made.matches("same words")
    assert not made.matches("same words ")


def test_passwords_are_hashed_with_argon2id_within_64_mib() -> None:
    """As the library reads it: the figures stand in the hash."""
    figures = argon2.extract_parameters(PasswordHash.of("same words").text)
    assert figures.type is argon2.Type.ID
    assert 46 * 1024 <= figures.memory_cost <= 64 * 1024
    assert figures.time_cost >= 2
    assert argon2.extract_parameters(OF_NOBODY.text) == figures
    assert not OF_NOBODY.matches("")


GOOD_ARGON2 = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1).hash("same words")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "neither Argon2id nor scrypt"),
        ("scrypt$1$2", "neither"),
        ("md5$2$1$1$aa$bb", "neither"),
        ("scrypt$1073741824$8$1$aa$bb", "figures that Hedgehop never wrote"),
        ("scrypt$3$8$1$aa$bb", "never wrote"),
        (GOOD_ARGON2[:-1], "neither"),
        (GOOD_ARGON2.replace("argon2id", "argon2i"), "neither"),
        (GOOD_ARGON2.replace("m=8", "m=4194304"), "never wrote: .argon2id.v=19.m=4194304,t=1,p=1"),
        (GOOD_ARGON2.replace("p=1", "p=0"), "never wrote"),
        (GOOD_ARGON2[:-1] + "/", "its Argon2id hash is damaged"),
    ],
)
def test_a_damaged_hash_is_refused_with_what_is_wrong(text: str, told: str) -> None:
    assert PasswordHash.read(GOOD_ARGON2).matches("same words")
    with pytest.raises(ValueError, match=told):
        PasswordHash.read(text)


def test_a_damaged_hash_is_told_with_the_name_of_its_account(
    auth: Auth, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    auth.accounts.add("Anna", "operator")
    file = tmp_path / "accounts.json"
    file.write_text(file.read_text().replace('"password": ""', '"password": "$argon2id$v=19$"'))
    with pytest.raises(SignInError):
        enter(auth, "Anna", "hers alone")
    assert "the password of 'Anna' cannot be used: its hash is damaged" in caplog.text


# Hashes of before


def old_hash(password: str) -> PasswordHash:
    salt = bytes(range(16))
    digest = hashlib.scrypt(password.encode(), salt=salt, n=2, r=8, p=1)
    return PasswordHash.read(f"scrypt$2$8$1${salt.hex()}${digest.hex()}")


def test_a_password_of_before_lets_in_and_is_hashed_anew_without_ending_anything(auth: Auth) -> None:
    auth.accounts.add("Anna", "operator")
    auth.accounts.set_password("Anna", old_hash("hers alone"))
    earlier, invitation = auth.redeem(auth.accounts.invite("Anna")), auth.accounts.invite("Anna")
    with pytest.raises(SignInError):
        enter(auth, "Anna", "hers alone ")
    kept = auth.accounts.find("Anna")
    assert kept is not None
    assert kept.password == old_hash("hers alone").text
    session = enter(auth, "Anna", "hers alone")
    anew = auth.accounts.find("Anna")
    assert anew is not None
    assert anew.password.startswith("$argon2id$")
    assert lasts(auth, earlier)
    assert lasts(auth, session)
    assert lasts(auth, auth.redeem(invitation))
    assert lasts(auth, enter(auth, "Anna", "hers alone"))
    assert auth.accounts.find("Anna") == anew


def test_a_password_that_has_changed_meanwhile_is_not_hashed_back(auth: Auth) -> None:
    auth.accounts.add("Anna", "operator")
    before = auth.accounts.set_password("Anna", old_hash("hers alone"))
    changed = auth.accounts.set_password("Anna", PasswordHash.of("another one"))
    auth.accounts.keep_anew(before, PasswordHash.of("hers alone"))
    assert auth.accounts.find("Anna") == changed


def test_the_owners_sessions_outlive_the_hash_of_before(auth: Auth, make: Callable[..., Auth], tmp_path: Path) -> None:
    session, file = enter(auth), tmp_path / "sessions.json"
    kept = json.loads(file.read_text())
    kept["owner_password"] = old_hash(GOOD).text
    file.write_text(json.dumps(kept))
    again = make()
    assert lasts(again, session)
    assert lasts(again, enter(again))
    assert json.loads(file.read_text())["owner_password"].startswith("$argon2id$")
