"""One of this station's vehicles as other stations are told of it."""

from __future__ import annotations

from server.heard.channel import Channel
from server.schemas import VehicleDoc
from telemetry.topics.messages import LinkStatus
from telemetry.topics.station_vehicles import FleetVehicle


def fleet_vehicle(
    doc: VehicleDoc,
    channel: Channel,
    link: LinkStatus | None,
    *,
    in_charge_silent: bool = False,
    line: tuple[int, float | None] = (0, None),
) -> FleetVehicle:
    """``doc``: as this station's own pages are told of it. ``in_charge_silent``: nothing is heard of its holder.
    ``line``: what the line that it flies is known by, and where on it it is."""
    alarm = "" if doc.alarm is None else doc.alarm.text
    state, follow = channel.state, channel.follow
    if state is None:
        return FleetVehicle(
            doc.number,
            doc.name,
            in_charge=doc.holder or "",
            in_charge_silent=in_charge_silent,
            link=doc.link,
            alarm=alarm,
        )
    velocity = None
    if state.v_east_m_s is not None and state.v_north_m_s is not None and state.v_down_m_s is not None:
        velocity = state.v_east_m_s, state.v_north_m_s, -state.v_down_m_s
    # A guided way that leads to no item of the mission is not the plan that is on board.
    is_way = channel.flight.way == "guided" and channel.flight.target is None
    is_flown = channel.in_air and not is_way and follow is not None and follow.progress is not None
    return FleetVehicle(
        number=doc.number,
        name=doc.name,
        in_charge=doc.holder or "",
        in_charge_silent=in_charge_silent,
        mode=state.mode,
        phase=doc.phase,
        armed=state.armed,
        in_air=channel.in_air,
        link=doc.link,
        link_quality=None if link is None else link.quality,
        position_t_mono_s=state.position_t_mono_s,
        lat_deg=state.lat_deg,
        lon_deg=state.lon_deg,
        alt_amsl_m=state.alt_amsl_m,
        alt_rel_home_m=state.alt_rel_home_m,
        alt_surface_m=None if follow is None else follow.height_above_dsm_m,
        v_enu_m_s=velocity,
        heading_rad=state.heading_rad,
        within_m=state.horizontal_accuracy_m,
        battery_share=state.battery_share,
        battery=channel.battery,
        plan=doc.plan_name if is_flown else "",
        plan_share=follow.progress if is_flown and follow is not None else None,
        alarm=alarm,
        line=line[0],
        line_s=line[1],
    )
