"""A crew's checklist as text: what is a point, what a heading, and what is too much."""

from dataclasses import replace

import pytest

from planning.errors import FormatError
from telemetry.topics.checklist import (
    LONGEST_LINE,
    MOST_CHARACTERS,
    MOST_POINTS,
    SUGGESTED,
    ChecklistPoint,
    digest_of,
    points_of,
)


def test_a_line_is_a_point_under_the_heading_before_it() -> None:
    text = "Battery full\r\n\r\n# Place\n- No people\n* No wires\n- [ ] Wind\t will do \n#\n[ ] Home seen\n-\n   \n"
    assert points_of(text) == (
        ChecklistPoint("Battery full"),
        ChecklistPoint("No people", "Place"),
        ChecklistPoint("No wires", "Place"),
        ChecklistPoint("Wind will do", "Place"),
        ChecklistPoint("Home seen"),
    )


@pytest.mark.parametrize("text", ["", "\n \n", "# Only a heading\n", "\u202e\x00\n"])
def test_what_has_no_point_demands_nothing(text: str) -> None:
    assert points_of(text) == ()


def test_characters_that_turn_or_hide_text_are_left_out() -> None:
    assert points_of("Arm\u202e the\x1b[2J vehicle <b>now</b>") == (ChecklistPoint("Arm the[2J vehicle <b>now</b>"),)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("x" * LONGEST_LINE + "\n" + "y" * (LONGEST_LINE + 1), f"Line 2 has {LONGEST_LINE + 1} characters"),
        ("point\n" * (MOST_POINTS + 1), f"has {MOST_POINTS + 1} points, more than {MOST_POINTS}"),
        ("\n" * (MOST_CHARACTERS + 1), "characters, more than 8,000"),
    ],
)
def test_what_is_too_much_is_refused_with_its_figure(text: str, what: str) -> None:
    with pytest.raises(FormatError, match=what) as caught:
        points_of(text, where="list.txt")
    assert (caught.value.where, caught.value.advice[:7]) == ("list.txt", "Shorten")


def test_the_longest_list_that_is_allowed_is_kept_whole() -> None:
    line = "x" * LONGEST_LINE
    assert [point.text for point in points_of("\n".join([line] * MOST_POINTS))] == [line] * MOST_POINTS


def test_the_suggested_list_is_one() -> None:
    points = points_of(SUGGESTED)
    assert 5 <= len(points) <= 12
    assert {point.heading for point in points} == {"Vehicle", "Place", "Crew"}


def test_a_list_is_another_by_its_words_and_not_by_its_ticks() -> None:
    points = points_of("# A\none\ntwo")
    assert digest_of(points) == digest_of((replace(points[0], ticked_by="Anna", ticked_utc_s=1.0), points[1]))
    others = ("# A\none\ntwo!", "# B\none\ntwo", "# A\ntwo\none", "# A\none", "# A\none\n# B\ntwo")
    assert digest_of(points) not in {digest_of(points_of(other)) for other in others}
