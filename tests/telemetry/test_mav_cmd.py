"""Planning knows no MAVLink library: its numbers are held against one here."""

from __future__ import annotations

from enum import IntEnum

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.mav_cmd import MavCmd, MavFrame


@pytest.mark.parametrize("ours", [MavCmd, MavFrame])
def test_every_name_has_the_number_of_the_standard(ours: type[IntEnum]) -> None:
    prefix = {MavCmd: "MAV_CMD", MavFrame: "MAV_FRAME"}[ours]
    named = {prefix + "_" + entry.name: int(entry) for entry in ours}
    assert named == {name: getattr(mavlink, name) for name in named}


def test_numbers_are_written_as_numbers() -> None:
    assert f"{MavCmd.NAV_LAND}" == str(MavCmd.NAV_LAND) == "21"
