"""Vehicle profiles from and to TOML."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.basics.plan_model import Camera, VehicleProfile
from planning.errors import FormatError, ParameterError
from planning.missions.vehicle_profile import (
    check_profile,
    dump_profile,
    load_profile,
    parse_profile,
    path_params,
    shipped_profiles,
)

CAMERA = Camera(6000, 4000, 20.0, 23.5, 15.6)


def test_the_shipped_profiles_are_sound() -> None:
    assert set(shipped_profiles()) == {"f450-paper", "generic-quad", "x500-rtk-px4", "mapper-rtk"}
    loaded = {name: load_profile(name) for name in shipped_profiles()}
    assert loaded["generic-quad"] == replace(VehicleProfile("Generic quadrotor"))
    assert loaded["x500-rtk-px4"].firmware == "px4"
    assert loaded["x500-rtk-px4"].max_items == 500
    assert loaded["mapper-rtk"].camera is not None
    assert loaded["f450-paper"].position_error_m == 2.5
    assert load_profile() == loaded["generic-quad"]


def test_terms_that_are_left_to_hedgehop_are_not_written() -> None:
    own = VehicleProfile("own", following_m=0.4, downwash_m=0.0, dsm_rms_m=0.1, mass_kg=3.2, rotors=6)
    assert parse_profile(dump_profile(own).encode(), where="x.toml") == own
    assert "following_m" not in dump_profile(VehicleProfile("measured"))


@settings(deadline=None)
@given(st.text(), st.floats(0.1, 20), st.integers(4, 5000), st.booleans())
def test_what_is_saved_is_read_back(name: str, speed_m_s: float, max_items: int, with_camera: bool) -> None:
    profile = VehicleProfile(
        name,
        mean_speed_m_s=speed_m_s,
        max_speed_m_s=1.5 * speed_m_s,
        max_items=max_items,
        camera=CAMERA if with_camera else None,
    )
    try:
        data = dump_profile(profile).encode()
    except UnicodeEncodeError:
        return
    assert parse_profile(data, where="x.toml") == profile


def test_a_file_is_read_by_its_path(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('name = "Mine"\nmean_speed_m_s = 4\n')
    assert load_profile(file) == VehicleProfile("Mine", mean_speed_m_s=4.0)


def test_a_missing_file_names_those_that_exist() -> None:
    with pytest.raises(FormatError, match="generic-quad"):
        load_profile("no-such-profile")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("name = 3", ["not text", 'key "name"']),
        ("radius_m = 1.0", ['no "name"']),
        ('name = "a"\nspeed = 3', ['Unknown key "speed"', "mean_speed_m_s"]),
        ('name = "a"\nradius_m = "wide"', ["'wide' is not a number", 'key "radius_m"']),
        ('name = "a"\nradius_m = true', ["not a number"]),
        ('name = "a"\nmax_items = 3.5', ["whole number"]),
        ('name = "a"\ncamera = 3', ["no table"]),
        ('name = "a"\n[camera]\nfocal_mm = 3.0', ["lacks image_width_px"]),
        ('name = "a"\nradius_m = = 3', ["no TOML", "line 2"]),
        (dump_profile(VehicleProfile("a", camera=CAMERA)) + "x = 1", ["[camera]", 'Unknown key "x"']),
    ],
)  # fmt: skip
def test_broken_files_say_where(text: str, parts: list[str]) -> None:
    with pytest.raises(FormatError) as error:
        parse_profile(text.encode(), where="my.toml")
    for part in ["my.toml", *parts]:
        assert part in str(error.value)


def test_bytes_that_are_no_text_and_files_that_are_too_large() -> None:
    with pytest.raises(FormatError, match="no TOML"):
        parse_profile(b"\xff\xfe", where="x")
    with pytest.raises(FormatError, match="bytes"):
        parse_profile(b"#" * 100_000, where="x")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"radius_m": -1.0}, "radius_m"),
        ({"endurance_s": float("nan")}, "endurance_s"),
        ({"max_climb_m_s": 0.0}, "max_climb_m_s"),
        ({"max_speed_m_s": 3.0}, "max_speed_m_s"),
        ({"max_speed_m_s": 6.1}, "max_speed_m_s"),
        ({"reserve_share": 1.0}, "reserve_share"),
        ({"max_items": 3}, "max_items"),
        ({"firmware": "betaflight"}, "firmware"),
        ({"camera": replace(CAMERA, focal_mm=0.0)}, "focal_mm"),
    ],
)
def test_contradictions_name_the_key(change: dict, key: str) -> None:
    with pytest.raises(ParameterError) as error:
        check_profile(replace(VehicleProfile("a"), **change), where="my.toml")
    assert f'key "{key}"' in error.value.where
    assert "my.toml" in error.value.where
    assert error.value.advice


def test_zero_is_fine_where_it_means_none() -> None:
    profile = VehicleProfile("a", position_error_m=0.0, rtl_height_m=0.0, reserve_share=0.0)
    check_profile(profile)
    assert path_params(profile).max_speed_m_s == profile.max_speed_m_s
