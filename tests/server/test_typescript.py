"""The browser's types are the server's."""

from __future__ import annotations

import pytest

from server.schemas.typescript import TARGET, _type, generate


def test_the_console_has_the_present_types() -> None:
    assert TARGET.read_text(encoding="utf-8") == generate(), "run: python -m server.schemas.typescript"


def test_names_options_and_unions() -> None:
    text = generate()
    assert "  loiter_s: number;" in text
    assert "  coalesce?: boolean;" in text
    assert '  type: "hover_profile";' in text
    assert "  surface_rel_home_m: (number | null)[];" in text
    assert '  shading: "height" | "hillshade" | "orthophoto";' in text
    assert "export type ServerMessage =\n  | Snapshot\n" in text


def test_the_console_asks_for_no_other_numbers_than_the_server_takes() -> None:
    text = generate()
    assert "    radar_depth_m: { min: 2, max: 120 },\n" in text
    assert "    camera_trigger_m: { min: 0.1, max: 1_000, initial: 5 },\n" in text, "above zero has no least number"
    assert "    radius_m: { min: 0.1, max: 1_000, initial: 20.0 },\n" in text
    assert "    paper_bare" not in text


def test_a_type_that_has_no_counterpart_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot write"):
        _type(complex)
