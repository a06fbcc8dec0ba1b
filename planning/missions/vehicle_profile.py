"""Vehicle profiles as TOML files: shipped ones by name, own ones by path."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from planning.basics import limits
from planning.basics.plan_model import Camera, PathParams, VehicleProfile
from planning.errors import FormatError, ParameterError

SHIPPED = Path(__file__).parent / "profiles"
DEFAULT_PROFILE = "generic-quad"
FIRMWARES = ("ardupilot", "px4")
MAX_FILE_BYTES = 65_536
MAY_BE_ZERO = {"reserve_share", *(key for key, limit in limits.PROFILE.items() if limit.zero)}


def shipped_profiles() -> tuple[str, ...]:
    """Names of the profiles that come with Hedgehop."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def load_profile(name_or_path: str | Path = DEFAULT_PROFILE) -> VehicleProfile:
    """A shipped profile by its name, or one from a TOML file: SI units, the names of ``VehicleProfile``'s fields.

    Raises ``FormatError`` for what is no profile and ``ParameterError`` for a value out of range.
    """
    path = SHIPPED / f"{name_or_path}.toml" if str(name_or_path) in shipped_profiles() else Path(name_or_path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(
            f"There is no readable vehicle profile ({error.strerror}).",
            where=str(name_or_path),
            advice=f"Give a TOML file or one of {', '.join(shipped_profiles())}.",
        ) from error
    return parse_profile(data, where=path.name)


def parse_profile(data: bytes, *, where: str) -> VehicleProfile:
    """The profile that a TOML file's bytes describe; ``where`` names the file in errors."""
    if len(data) > MAX_FILE_BYTES:
        raise FormatError(f"The profile has {len(data)} bytes.", where=where, advice="Give a vehicle profile.")
    try:
        table = tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FormatError(f"The profile is no TOML: {error}.", where=where, advice="Correct that line.") from error
    profile = profile_from_table(table, where=where)
    check_profile(profile, where=where)
    return profile


def profile_from_table(table: Mapping[str, Any], *, where: str) -> VehicleProfile:
    """The profile from a table of its fields; keys left out keep their defaults, unknown ones are errors."""
    values = dict(table)
    if "name" not in values:
        raise FormatError('The profile has no "name".', where=where, advice='Add a line such as name = "my quad".')
    camera = values.pop("camera", None)
    if camera is not None:
        if not isinstance(camera, Mapping):
            raise FormatError('"camera" is no table.', where=where, advice="Write its keys below a line [camera].")
        missing = [f.name for f in fields(Camera) if f.name not in camera]
        if missing:
            raise FormatError(f"The camera lacks {', '.join(missing)}.", where=f"{where} [camera]", advice="Add them.")
        camera = Camera(**_typed(camera, Camera, f"{where} [camera]"))
    return VehicleProfile(**_typed(values, VehicleProfile, where), camera=camera)


def _typed(table: Mapping[str, Any], kind: type, where: str) -> dict[str, Any]:
    types = {f.name: str(f.type) for f in fields(kind) if f.name != "camera"}
    for key in table:
        if key not in types:
            raise FormatError(f'Unknown key "{key}".', where=where, advice=f"Known keys: {', '.join(types)}.")
    return {key: _value(value, types[key], f'{where}, key "{key}"') for key, value in table.items()}


def _value(value: Any, kind: str, where: str) -> Any:
    kind = kind.removesuffix(" | None")
    if kind in ("int", "float"):
        whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
        if isinstance(value, bool) or not isinstance(value, int | float) or (kind == "int" and not whole):
            what = "a whole number" if kind == "int" else "a number"
            raise FormatError(f"{value!r} is not {what}.", where=where, advice=f"Give {what} without quotes.")
        return int(value) if kind == "int" else float(value)
    if not isinstance(value, str):
        raise FormatError(f"{value!r} is not text.", where=where, advice='Put it in quotes: "...".')
    return value


def check_profile(profile: VehicleProfile, *, where: str = "vehicle profile") -> None:
    """Raise ``ParameterError`` naming the first key that is out of range or contradicts another."""
    if profile.firmware not in FIRMWARES:
        _refuse(f'The firmware is "{profile.firmware}".', where, "firmware", f"Give one of {', '.join(FIRMWARES)}.")
    _check_numbers(profile, where)
    if profile.camera is not None:
        _check_numbers(profile.camera, f"{where} [camera]")
    if profile.reserve_share >= 1:
        _refuse(f"A reserve of {profile.reserve_share:g} leaves no time to fly.", where, "reserve_share", "Give 0.25.")
    mean, top = profile.mean_speed_m_s, profile.max_speed_m_s
    if not limits.speeds_agree(mean, top):
        _refuse(
            f"A mean speed of {mean:g} m/s and a maximum speed of {top:g} m/s contradict each other.",
            where,
            "max_speed_m_s",
            f"Give more than {mean:g} and at most {2 * mean:g} m/s.",
        )
    if profile.max_items < limits.FEWEST_ITEMS:
        _refuse(
            f"A vehicle that takes {profile.max_items} items cannot fly a mission.", where, "max_items", "Give more."
        )


def _check_numbers(data: VehicleProfile | Camera, where: str) -> None:
    for key, value in asdict(data).items():
        if not isinstance(value, int | float):
            continue
        if not math.isfinite(value) or value < 0 or (value == 0 and key not in MAY_BE_ZERO):
            least = "zero or more" if key in MAY_BE_ZERO else "a positive number"
            _refuse(f"{value:g} is out of range.", where, key, f"Give {least}.")


def _refuse(what: str, where: str, key: str, advice: str) -> None:
    raise ParameterError(what, where=f'{where}, key "{key}"', advice=advice)


def dump_profile(profile: VehicleProfile) -> str:
    """The profile as TOML text that ``parse_profile`` reads back equal."""
    values = asdict(profile)
    camera = values.pop("camera")
    lines = [f"{key} = {_toml(value)}" for key, value in values.items() if value is not None]
    if camera is not None:
        lines += ["", "[camera]", *(f"{key} = {_toml(value)}" for key, value in camera.items())]
    return "\n".join(lines) + "\n"


def _toml(value: str | float) -> str:
    """JSON's escapes are TOML's, but for DEL, which TOML wants escaped."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f") if isinstance(value, str) else repr(value)


def path_params(profile: VehicleProfile) -> PathParams:
    """Path parameters with the vehicle's own speeds and limits, sampled every 0.10 m (Melita 2020, section 6)."""
    return PathParams(
        mean_speed_m_s=profile.mean_speed_m_s,
        max_speed_m_s=profile.max_speed_m_s,
        max_climb_m_s=profile.max_climb_m_s,
        max_descent_m_s=profile.max_descent_m_s,
        max_accel_m_s2=profile.max_accel_m_s2,
    )
