import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.errors import FormatError
from planning.formats import safe_text
from planning.formats.safe_text import check_lat_lon, clean_name, decode_text, finite, load_json


def test_byte_order_mark_and_latin_1_are_understood():
    assert decode_text("a", b"\xef\xbb\xbfH\xc3\xbctte") == "Hütte"
    assert decode_text("a", b"H\xfctte") == "Hütte"


@pytest.mark.parametrize("data", [b"a\x00b", b"\xff\xfea\x00", b"x" * (safe_text.MAX_BYTES + 1)])
def test_binary_utf16_and_oversized_files_are_refused(data):
    with pytest.raises(FormatError):
        decode_text("a", data)


@pytest.mark.parametrize("text", ['{"a": NaN}', '{"a": -Infinity}', '{"a": ', "[" * 100_000, "9" * 5000])
def test_bad_json_is_refused(text):
    with pytest.raises(FormatError):
        load_json("a", text)


def test_brackets_inside_strings_are_no_depth():
    text = '["' + "[" * 500 + '\\"' + "]" * 500 + '"]'
    assert load_json("a", text) == ["[" * 500 + '"' + "]" * 500]


@pytest.mark.parametrize("unclosed", ['{"' + '\\"' * 50_000, '["a\\'])
def test_a_string_that_is_never_closed_is_refused_after_one_look_at_it(unclosed):
    began_s = time.process_time()
    with pytest.raises(FormatError, match="not valid JSON"):
        load_json("parameters.json", unclosed)
    assert time.process_time() - began_s < 1.0


@given(st.text(max_size=300))
def test_names_come_out_short_and_on_one_line(text):
    name = clean_name(text)
    assert len(name) <= safe_text.MAX_NAME_LENGTH
    assert name == clean_name(name)
    assert name.isprintable() or all(c.isprintable() or c.isspace() for c in name)


def test_names_keep_markup_but_lose_control_and_direction_characters():
    assert clean_name("<b>\u202ea\x00\x1b\n b") == "<b>a b"


@pytest.mark.parametrize("value", ["inf", "nan", "1e999", "", "x", None, True, [], 10**400])
def test_only_finite_numbers_pass(value):
    with pytest.raises(FormatError, match="speed"):
        finite(value, "speed", "row 3")


def test_an_impossible_latitude_suggests_the_swap():
    with pytest.raises(FormatError, match="swapped"):
        check_lat_lon(175.0, -37.0, "row 1")
    with pytest.raises(FormatError, match="degrees"):
        check_lat_lon(1750.0, -37.0, "row 1")
