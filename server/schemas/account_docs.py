"""Accounts, sessions, and who is in charge."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.schemas.strict_model import Name, Strict

RoleName = Literal["operator", "observer"]
NewPassword = Annotated[str, StringConstraints(min_length=8, max_length=1024)]


class MeDoc(Strict):
    """Who this page is."""

    name: str
    role: RoleName
    owner: bool
    """Of this machine: in by the printed link or by the password of the settings."""


class LeaseDoc(Strict):
    """Who is in charge. Only they can command the vehicle."""

    holder: str | None
    mine: bool
    silent: bool = False
    """Nothing is heard of the holder's pages: control can be taken by a press."""
    asks: str | None = None
    """Told to the holder: who asks for control."""
    waits: bool = False
    """Told to who asks: the holder has not answered yet."""


class AccountDoc(Strict):
    name: str
    role: RoleName
    has_password: bool
    invited_until_utc_s: float | None = None
    """Its newest link that has not been used leads in until then."""


class SessionDoc(Strict):
    id: str
    name: str
    role: RoleName
    since_utc_s: float
    seen_utc_s: float
    address: str
    mine: bool
    """The session that asks."""
    in_charge: bool


class InvitationDoc(Strict):
    link: str
    """Signs in once."""
    expires_utc_s: float


# Bodies of requests


class SignIn(Strict):
    name: Name = ""
    """Of the account; none: the owner of the machine."""
    password: Annotated[str, StringConstraints(max_length=1024)]


class NewAccount(Strict):
    name: Annotated[str, Field(min_length=1, max_length=80)]
    role: RoleName


class ChangePassword(Strict):
    password: NewPassword
