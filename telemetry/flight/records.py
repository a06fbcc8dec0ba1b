"""What is flown, written down for recordings: complete enough to judge the flight later without the plan's files."""

from __future__ import annotations

import json
import time

from planning.certificate.clearance import certificate_json
from planning.formats.wpl import write_wpl
from planning.model import Certificate, Mission, finite_or_none
from planning.terrain.dsm import Dsm
from telemetry.topics.messages import PlanRecord


def plan_record(
    mission: Mission,
    *,
    digest: str,
    name: str,
    dsm: Dsm | None,
    certificate: Certificate | None,
    profile_toml: str,
) -> PlanRecord:
    """Of a mission as it is on board; ``certificate`` is of what was read back."""
    return PlanRecord(
        t_utc_s=time.time(),
        name=name,
        mission_wpl=write_wpl(mission),
        digest=digest,
        firmware=mission.firmware,
        terrain_id="",
        terrain_name="",
        terrain_sha256=dsm.sha256 if dsm is not None else "",
        home_alt_dsm_m=finite_or_none(mission.home.alt_dsm_m),
        vertical_datum=mission.home.vertical_datum,
        profile_toml=profile_toml,
        certificate_json="" if certificate is None else json.dumps(certificate_json(certificate), allow_nan=False),
    )
