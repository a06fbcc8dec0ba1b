"""``hedgehop account``: who may sign in, from the terminal; a server that runs sees every change at once."""

from __future__ import annotations

import getpass
import sys
import time
from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from server.app import origin_file
from server.cli.shared.command import command
from server.cli.shared.output import say
from server.door.accounts import INVITED_S, OWNER, Accounts
from server.door.passwords import PasswordHash, check_password
from server.errors import BadRequestError
from server.settings import Settings, load_settings

DataDir = Annotated[Path | None, Option(help="Where the accounts are kept; default: the user's data home.")]
Name = Annotated[str, Argument(metavar="NAME")]


def _accounts(settings: Settings) -> Accounts:
    settings.data_dir.mkdir(mode=0o700, parents=True, exist_ok=True)
    return Accounts(settings.data_dir)


def _say_link(settings: Settings, accounts: Accounts, name: str) -> None:
    file = origin_file(settings)
    origin = file.read_text(encoding="ascii") if file.is_file() else f"http://127.0.0.1:{settings.port}"
    link = f"{origin}/login?token={accounts.invite(name)}"
    say(f"This link signs {name or 'the owner of this machine'} in once, within {INVITED_S / 3600:g} hours:")
    say(f"  {link}")


@command
def add(
    name: Name,
    *,
    role: Annotated[
        Literal["operator", "observer"], Option(help="Operators change things and may fly; observers look on.")
    ],
    data_dir: DataDir = None,
) -> None:
    """Make an account, and print a link that signs in once."""
    settings = load_settings(data_dir=data_dir)
    accounts = _accounts(settings)
    account = accounts.add(name, role)
    say(f"{account.name} is an {role}.")
    _say_link(settings, accounts, account.name)


@command
def link(
    name: Annotated[str, Argument(metavar="[NAME]", help="None: the owner of this machine.")] = OWNER,
    *,
    data_dir: DataDir = None,
) -> None:
    """Print a further link that signs in once: the way in when a password is forgotten."""
    settings = load_settings(data_dir=data_dir)
    _say_link(settings, _accounts(settings), name)


@command
def password(name: Name, *, data_dir: DataDir = None) -> None:
    """Give an account a password, asked for twice, or read from standard input; its sessions end."""
    accounts = _accounts(load_settings(data_dir=data_dir))
    account = accounts.set_password(name, PasswordHash.of(check_password(_asked())))
    say(f"{account.name} has a new password and is signed out everywhere.")


@command
def remove(name: Name, *, data_dir: DataDir = None) -> None:
    """Remove an account; its sessions end."""
    _accounts(load_settings(data_dir=data_dir)).remove(name)
    say(f"{name} is removed and signed out everywhere.")


@command
def list_(*, data_dir: DataDir = None) -> None:
    """Say who may sign in."""
    accounts = _accounts(load_settings(data_dir=data_dir))
    if not accounts.all:
        say("There are no accounts: only the owner of this machine signs in.")
    for account in accounts.all:
        until_utc_s = accounts.invited_until_utc_s(account.name)
        until = "" if until_utc_s is None else time.strftime("%H:%M on %d %B", time.localtime(until_utc_s))
        invited = f", link until {until}" if until else ""
        say(f"{account.name}: {account.role}, {'password' if account.password else 'no password'}{invited}")


def _asked() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    given = getpass.getpass("New password: ")
    if getpass.getpass("Once more: ") != given:
        raise BadRequestError("The two are not the same.", advice="Try again.")
    return given
