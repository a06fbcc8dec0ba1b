"""Settings: defaults, then a TOML file, then environment variables ``HEDGEHOP_...``, then the command line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, SecretStr, ValidationError, model_validator
from pydantic_settings import (
    BaseSettings,
    NoDecode,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)

from server.errors import StartError, error_doc
from telemetry.errors import StationsError
from telemetry.stations.station_names import router_endpoint
from telemetry.topics.vehicle import RadarKind

GIB = 1024**3
MOST_VEHICLES = 8
NAME_CHARS = 24


def _split(value: object) -> object:
    return tuple(part.strip() for part in value.split(",") if part.strip()) if isinstance(value, str) else value


Names = Annotated[tuple[str, ...], NoDecode, BeforeValidator(_split)]


DemoAutopilot = Literal["ardupilot", "px4"]
DemoAutopilots = Annotated[
    tuple[DemoAutopilot, ...], NoDecode, BeforeValidator(_split), Field(max_length=MOST_VEHICLES)
]


def named_links(text: str) -> tuple[str, tuple[str, ...]]:
    """``NAME=LINK[,LINK]``: a vehicle's name and the connections to it. Raises ValueError."""
    name, _, links = text.partition("=")
    found = tuple(part.strip() for part in links.split(",") if part.strip())
    if not name.strip() or len(name.strip()) > NAME_CHARS or not found:
        raise ValueError(f"{text!r} is no vehicle: write NAME=LINK, the name with at most {NAME_CHARS} characters.")
    return name.strip(), found


def _split_vehicles(value: object) -> object:
    return tuple(p.strip() for p in value.split(";") if p.strip()) if isinstance(value, str) else value


def _checked_vehicles(value: tuple[str, ...]) -> tuple[str, ...]:
    named = [named_links(text) for text in value]
    names, links = [name for name, _ in named], [link for _, links in named for link in links]
    for what, given in (("the same name", names), ("the same connection", links)):
        if twice := sorted({each for each in given if given.count(each) > 1}):
            raise ValueError(f"Two vehicles have {what}: {twice[0]}.")
    return value


Vehicles = Annotated[
    tuple[str, ...],
    NoDecode,
    BeforeValidator(_split_vehicles),
    AfterValidator(_checked_vehicles),
    Field(max_length=MOST_VEHICLES),
]


def _checked_routers(value: tuple[str, ...]) -> tuple[str, ...]:
    try:
        return tuple(router_endpoint(text) for text in value)
    except StationsError as error:
        raise ValueError(f"{error.what} {error.advice}") from error


Routers = Annotated[
    tuple[str, ...], NoDecode, BeforeValidator(_split), AfterValidator(_checked_routers), Field(max_length=8)
]


RUNTIME_FOLDER = "run"
"""Of the data directory, and of each vehicle's: the sockets of its nodes."""


def default_data_dir() -> Path:
    """The user's data home, by the XDG rule."""
    home = os.environ.get("XDG_DATA_HOME", "")
    return (Path(home) if Path(home).is_absolute() else Path.home() / ".local" / "share") / "hedgehop"


def default_console_dir() -> Path:
    return Path(__file__).resolve().parent.parent / "web" / "dist"


class Settings(BaseSettings):
    model_config = SettingsConfigDict(
        env_prefix="HEDGEHOP_", extra="forbid", frozen=True, use_attribute_docstrings=True
    )

    host: str = "127.0.0.1"
    """Address to listen on. Anything but loopback opens Hedgehop to the network, and needs TLS: see hedgehop tls."""
    port: Annotated[int, Field(ge=1, le=65535)] = 8000
    """Port of the console, the API and the 3D view."""
    behind_proxy: bool = False
    """Plain HTTP beyond loopback all the same: a proxy adds TLS, or a container publishes its port on loopback only."""
    tls_certificate: Path | None = None
    """A certificate (PEM, with those above it) to use instead of the one that hedgehop tls makes."""
    tls_key: Path | None = None
    """Its key, where that is a file of its own."""
    trust_port: Annotated[int, Field(ge=0, le=65535)] = 8001
    """Where other devices get the authority's certificate, over plain HTTP and nothing else; 0: nowhere."""
    data_dir: Path = Field(default_factory=default_data_dir)
    """Where surface models, plans and sessions are kept."""
    password: Annotated[SecretStr, Field(min_length=8, max_length=1024)] | None = None
    """Lets the owner of this machine sign in without the link that is printed at start; at least 8 characters. Others
    get accounts of their own: hedgehop account."""
    password_file: Path | None = None
    """A file with the password, such as a container's secret: unlike the environment, no other program is shown it."""
    session_days: Annotated[float, Field(gt=0, le=365)] = 30.0
    """How long a sign-in lasts."""
    allowed_hosts: Names = ()
    """Further names (with port) under which browsers may reach Hedgehop, separated by commas."""
    allowed_origins: Names = ()
    """Further origins, such as https://gcs.example when a proxy adds TLS, separated by commas."""
    upload_limit_bytes: Annotated[int, Field(gt=0)] = 2 * GIB
    """Largest surface model, orthophoto, recording, ROS bag or radar file that can be dropped in."""
    dsm_urls: Names = ()
    """Addresses below which the command line may read surface models by HTTP ranges, separated by commas:
    https://maps.example/dsm/. Nothing else is asked for, redirects are not followed."""
    link: Names = ()
    """Connections to vehicles, separated by commas: udpin:0.0.0.0:14550, tcp:10.0.0.7:5760, /dev/ttyACM0:57600. The
    first vehicle heard on one of them is the one that is flown; the others are further ways to it."""
    vehicle: Vehicles = ()
    """Several vehicles, each with its name and its connections, separated by semicolons: Bee=udpin:0.0.0.0:14550;
    Wasp=udpin:0.0.0.0:14560. What link names is the first vehicle then, and these come after it."""
    stations_router: Routers = ()
    """The router at which several stations see each other's vehicles: HOST or HOST:PORT, several separated by commas
    (the first that answers is used). Goes with stations_file; without both no station is told or heard of."""
    stations_file: Path | None = None
    """This station's key and certificates, which hedgehop stations makes: they also say its name."""
    stations_recordings: bool = True
    """Whether other stations may list and fetch this one's recordings. Those of others can be fetched either way."""
    stations_recordings_kb_s: Annotated[int, Field(ge=1, le=10_000)] = 8
    """How many kB of recordings per second go to other stations at most, to all of them together, and how many of
    theirs come in: behind 256 kbit/s a quarter of the line."""
    demo_vehicles: Annotated[int, Field(ge=1, le=MOST_VEHICLES)] = 1
    """How many simulated vehicles the demo has. Only the first one has sensors."""
    demo_autopilots: DemoAutopilots = ()
    """Whose behaviour the demo's simulated vehicles have, one after the other, separated by commas: ardupilot or px4.
    Vehicles beyond them are ArduCopters."""
    demo_world: bool = True
    """Whether the demo's simulated vehicle has radar and camera, in a world with things that its surface model does not
    know."""
    demo_radar: RadarKind = "model"
    """How the demo's radar is simulated. model: its targets are drawn to the errors of the real one; iq: the samples of
    its converters are, and the whole chain of processing runs on them, at a third of a processor core."""
    demo_traffic: bool = False
    """Whether the demo's simulated vehicles hear of an aircraft that flies past, every eight minutes."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """How much is written to the log."""
    console_dir: Path = Field(default_factory=default_console_dir)
    """Where the built console lies."""

    @model_validator(mode="after")
    def _check_vehicles(self) -> Self:
        if len(wanted := self.vehicles) > MOST_VEHICLES:
            raise ValueError(f"There are {len(wanted)} vehicles, and at most {MOST_VEHICLES} can be flown.")
        if wanted[0][0] in [name for name, _ in wanted[1:]]:
            raise ValueError(f"{wanted[0][0]} is the name of the one that link names: give the other one another name.")
        if twice := set(self.link) & {link for text in self.vehicle for link in named_links(text)[1]}:
            raise ValueError(f"{sorted(twice)[0]} is a connection of two vehicles.")
        return self

    @model_validator(mode="after")
    def _check_stations(self) -> Self:
        if bool(self.stations_router) != (self.stations_file is not None):
            raise ValueError("stations_router and stations_file belong together: set both, or neither.")
        return self

    def demo_autopilot(self, index: int) -> DemoAutopilot:
        """Of the demo's vehicle number ``index``, from 0 on."""
        return self.demo_autopilots[index] if index < len(self.demo_autopilots) else "ardupilot"

    @property
    def vehicles(self) -> list[tuple[str, tuple[str, ...]]]:
        """Name and connections of each, the first one first."""
        named = [named_links(text) for text in self.vehicle]
        if self.link or not named:
            named.insert(0, ("Vehicle 1", self.link))
        return named

    @model_validator(mode="before")
    @classmethod
    def _read_password_file(cls, values: dict[str, Any]) -> dict[str, Any]:
        file = values.get("password_file")
        if not file or values.get("password") is not None:
            return values
        try:
            return {**values, "password": Path(file).read_text(encoding="utf-8").strip()}
        except (OSError, UnicodeDecodeError) as error:
            raise StartError(
                f"The password's file cannot be read: {error}.",
                where="setting password_file",
                advice="Correct its path or its rights.",
            ) from error

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        del dotenv_settings, file_secret_settings
        return init_settings, env_settings, TomlConfigSettingsSource(settings_cls, settings_file())


def settings_file() -> Path:
    """``HEDGEHOP_SETTINGS_FILE``, else the user's own; neither need exist."""
    named = os.environ.get("HEDGEHOP_SETTINGS_FILE", "")
    home = os.environ.get("XDG_CONFIG_HOME", "")
    base = Path(home) if Path(home).is_absolute() else Path.home() / ".config"
    return Path(named) if named else base / "hedgehop" / "settings.toml"


def load_settings(**overrides: Any) -> Settings:
    """Settings with those overrides that are not None; raises ``StartError`` naming the faulty one."""
    if os.environ.get("HEDGEHOP_SETTINGS_FILE") and not settings_file().is_file():
        raise StartError(
            f"There is no settings file {settings_file()}.", advice="Correct or unset HEDGEHOP_SETTINGS_FILE."
        )
    try:
        return Settings(**{name: value for name, value in overrides.items() if value is not None})
    except ValidationError as error:
        fault = error_doc(error)
        what = fault.what if fault.where != "password" else "A password needs at least 8 characters."
        raise StartError(
            what,
            where=f"setting {fault.where}",
            advice=f"It is set by HEDGEHOP_{fault.where.split('.')[0].upper()}, by {settings_file()} or by an option.",
        ) from None
    except ValueError as error:
        raise StartError(f"The settings file cannot be read: {error}.", where=str(settings_file())) from error


def settings_document() -> str:
    """``docs/settings.md``: python -c "from server.settings import settings_document as d; print(d(), end='')"."""
    return f"""# Settings

Nothing has to be set: `hedgehop serve` runs with the defaults below. What is set in several places is taken from
the first of these:

1. the command line (`hedgehop serve --help`: host, port, data directory),
2. environment variables, `HEDGEHOP_` and the setting's name in capitals,
3. a settings file in TOML, one `name = value` per line: the file that `HEDGEHOP_SETTINGS_FILE` names, else
   `$XDG_CONFIG_HOME/hedgehop/settings.toml`, else `~/.config/hedgehop/settings.toml`,
4. the default.

A setting that is unknown or makes no sense stops the start with a message that names it.

{settings_table()}
An example of a file:

```toml
port = 8080
data_dir = "/srv/hedgehop"
allowed_hosts = ["gcs.example:443"]
allowed_origins = ["https://gcs.example"]
```
"""


def settings_table() -> str:
    """All settings as a Markdown table, for the documentation."""
    rows = ["| environment variable | in the file | default | meaning |", "|---|---|---|---|"]
    for name, field in Settings.model_fields.items():
        default = _DOCUMENTED.get(name) or str(field.default)
        meaning = " ".join((field.description or "").split())
        rows.append(f"| `HEDGEHOP_{name.upper()}` | `{name}` | {default} | {meaning} |")
    return "\n".join(rows) + "\n"


_DOCUMENTED = {
    "data_dir": "`$XDG_DATA_HOME/hedgehop`, else `~/.local/share/hedgehop`",
    "password": "none",
    "password_file": "none",
    "tls_certificate": "none",
    "tls_key": "none",
    "link": "none",
    "vehicle": "none",
    "stations_router": "none",
    "stations_file": "none",
    "demo_autopilots": "none",
    "allowed_hosts": "none",
    "allowed_origins": "none",
    "console_dir": "`web/dist` of the project",
}
