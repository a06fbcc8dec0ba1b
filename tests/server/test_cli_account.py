"""``hedgehop account``: what it writes lets people in, and what it removes shuts them out."""

from __future__ import annotations

import asyncio
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from server.cli import app
from server.door.accounts import OWNER, Accounts
from server.door.auth import Auth
from server.errors import SignInError


def told(data: Path, *arguments: str, given: str | None = None, code: int = 0) -> str:
    result = CliRunner().invoke(app, ["account", *arguments, "--data-dir", str(data)], input=given)
    assert result.exit_code == code, result.output
    return result.output


def token_of(text: str) -> str:
    found = re.search(r"http://127\.0\.0\.1:8000/login\?token=(\S+)", text)
    assert found
    return found[1]


def test_an_account_is_made_lets_in_and_is_removed(tmp_path: Path) -> None:
    data = tmp_path / "data"
    auth = Auth(tmp_path / "sessions.json", Accounts(data))
    made = told(data, "add", "Olga", "--role", "observer")
    invited = auth.identity(auth.redeem(token_of(made)))
    assert invited is not None
    assert (invited.name, invited.role) == ("Olga", "observer")
    assert "Olga: observer, no password" in told(data, "list")
    told(data, "password", "olga", given="short\n", code=2)
    told(data, "password", "olga", given="long enough\n")
    entered = asyncio.run(auth.sign_in("Olga", "long enough", ""))
    assert "Olga: observer, password" in told(data, "list")
    told(data, "remove", "Olga")
    assert auth.identity(entered) is None
    with pytest.raises(SignInError):
        asyncio.run(auth.sign_in("Olga", "long enough", ""))
    assert "no accounts" in told(data, "list")
    assert "no account" in told(data, "remove", "Olga", code=2)


def test_the_owner_comes_in_again(tmp_path: Path) -> None:
    auth = Auth(tmp_path / "sessions.json", Accounts(tmp_path))
    identity = auth.identity(auth.redeem(token_of(told(tmp_path, "link"))))
    assert identity is not None
    assert identity.is_owner
    assert OWNER == ""
