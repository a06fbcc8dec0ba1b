"""Prove the clearance of a mission that another ground station made, or hear what is wrong with it.

python examples/certify_a_mission.py [hillside.tif mission.waypoints] [--required-m 4]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from planning import ClearanceParams, certify, flown_line, load_profile, read_dsm, read_flight
from planning.ground.demo_hillside import demo_dsm

ANOTHER_STATIONS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t37.7290205\t14.9926236\t1711.99\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t4\t1
2\t0\t3\t16\t0\t0\t0\t0\t37.7290205\t14.9926236\t4\t1
3\t0\t3\t16\t0\t0\t0\t0\t37.7295073\t14.9941443\t4\t1
4\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""
"""Up, 145 m north-east at 4 m above home, and back: over a meadow of the generated hillside and past a ruin."""


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dsm", type=Path, nargs="?", help="surface model, GeoTIFF; default: a generated hillside")
    parser.add_argument("mission", type=Path, nargs="?", help=".waypoints, .plan, .kml; default: a short one")
    parser.add_argument("--required-m", type=float, default=4.0, help="clearance to be kept")
    parser.add_argument("--profile", default="generic-quad", help="vehicle: a shipped profile or a TOML file")
    given = parser.parse_args(arguments)

    dsm = read_dsm(given.dsm) if given.dsm else demo_dsm()
    name, data = (
        (given.mission.name, given.mission.read_bytes())
        if given.mission
        else ("another.waypoints", ANOTHER_STATIONS.encode())
    )
    vehicle = load_profile(given.profile)
    demands = ClearanceParams(
        required_clearance_m=given.required_m,
        vehicle_radius_m=vehicle.radius_m,
        position_error_m=vehicle.position_error_m,
        rtl_height_m=vehicle.rtl_height_m,
    )
    certificate = certify(dsm, flown_line(read_flight(name, data), dsm), demands)

    print(f"{name}: {'certified' if certificate.certified else 'NOT certified'}")
    worst = certificate.worst
    print(f"nearest: {certificate.min_distance_m:.2f} m, {worst.s_m:.0f} m along the line")
    print(f"that is at {worst.lat_deg:.6f}, {worst.lon_deg:.6f} deg, {worst.alt_rel_home_m:.1f} m above home")
    print(f"the way home needs {certificate.rtl_height_needed_m:.1f} m above home")
    for reason in certificate.reasons:
        print(f"- {reason.text} {reason.mend}")


if __name__ == "__main__":
    main()
