"""Photograph an area from a constant height above its surface, and see what the photos really show.

python examples/survey_an_area.py [hillside.tif area.geojson] [--gsd-cm 1]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from planning import PlanRequest, load_profile, path_params, plan_mission, read_dsm, survey_lines, survey_request
from planning.formats.poi_files import read_pois
from planning.ground.demo_hillside import demo_dsm, demo_survey_polygon


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dsm", type=Path, nargs="?", help="surface model, GeoTIFF; default: a generated hillside")
    parser.add_argument("area", type=Path, nargs="?", help="polygon: GeoJSON or KML; default: a hectare of it")
    parser.add_argument("--gsd-cm", type=float, default=1.0, help="ground that one pixel shall cover")
    parser.add_argument("--profile", default="mapper-rtk", help="vehicle with a camera")
    given = parser.parse_args(arguments)

    dsm = read_dsm(given.dsm) if given.dsm else demo_dsm()
    area = read_pois(given.area.name, given.area.read_bytes()).polygon if given.area else demo_survey_polygon()
    if area is None:
        parser.error(f"{given.area} holds no polygon")
    profile = load_profile(given.profile)
    lines = survey_lines(area, dsm, camera=profile.camera, side_overlap=0.7, front_overlap=0.8, gsd_cm=given.gsd_cm)
    request = survey_request(PlanRequest(pois=(), profile=profile, path=path_params(profile)), lines)
    plan = plan_mission(dsm, request)

    print(f"{lines.lines} lines {lines.line_spacing_m:.1f} m apart, {lines.height_m:.1f} m above the surface")
    print(f"a photo every {lines.trigger_distance_m:.1f} m, {plan.path.s_m[-1]:.0f} m, {plan.predicted.total_s:.0f} s")
    verdict = "certified" if plan.certificate.certified else "NOT certified"
    print(f"{verdict}: {plan.certificate.min_distance_m:.2f} m from the ground at the nearest")
    if plan.coverage is not None:
        seen = plan.coverage
        print(f"{seen.photos} photos show {100 * seen.photographed_share:.0f} % of {seen.area_m2:.0f} m2")
        print(f"twice or more: {100 * seen.twice_share:.0f} %, one pixel covers up to {seen.gsd_cm or 0.0:.2f} cm")


if __name__ == "__main__":
    main()
