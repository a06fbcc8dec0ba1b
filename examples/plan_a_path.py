"""Plan a flight a few metres above rough ground, prove its clearance, write its files.

python examples/plan_a_path.py [hillside.tif pois.csv] [--height-m 5] [--out flight]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from planning import FILES, PlanRequest, SurfaceParams, export_file, load_profile, path_params, plan_mission, read_dsm
from planning.formats.poi_files import read_pois
from planning.ground.demo_hillside import demo_dsm, demo_pois


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dsm", type=Path, nargs="?", help="surface model, GeoTIFF; default: a generated hillside")
    parser.add_argument("pois", type=Path, nargs="?", help="points: CSV, GeoJSON, KML; default: six on that hillside")
    parser.add_argument("--profile", default="mapper-rtk", help="vehicle: a shipped profile or a TOML file")
    parser.add_argument("--height-m", type=float, default=5.0, help="H of the ball that the surface is dilated with")
    parser.add_argument("--out", type=Path, help="folder for the mission, its certificate and report")
    given = parser.parse_args(arguments)

    dsm = read_dsm(given.dsm) if given.dsm else demo_dsm()
    pois = read_pois(given.pois.name, given.pois.read_bytes()).pois if given.pois else demo_pois()
    profile = load_profile(given.profile)
    surface = SurfaceParams(height_m=given.height_m)
    plan = plan_mission(dsm, PlanRequest(pois=tuple(pois), profile=profile, path=path_params(profile), surface=surface))

    certificate = plan.certificate
    print("certified" if certificate.certified else "NOT certified", "for the", profile.name)
    print(f"nearest: {certificate.min_distance_m:.2f} m, required: {certificate.required_clearance_m:.2f} m")
    print(f"path: {plan.path.s_m[-1]:.0f} m, {plan.built.waypoints} waypoints, {plan.predicted.total_s:.0f} s to fly")
    for reason in certificate.reasons:
        print(f"- {reason.text} {reason.mend}")
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (given.out / name).write_text(export_file(name, plan, dsm), encoding="utf-8")
        print(f"written to {given.out}: {', '.join(FILES)}")


if __name__ == "__main__":
    main()
