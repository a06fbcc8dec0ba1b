"""Files that other programs read and write: each format's writer and its own reader."""

from planning.formats.detect import read_flight, read_mission
from planning.formats.geojson import GeoJsonPlan, read_geojson, write_geojson
from planning.formats.kml import KmlTrack, read_kml_track, write_kml
from planning.formats.poi_csv import write_pois_csv
from planning.formats.qgc_plan import read_plan, write_plan
from planning.formats.trajectory_csv import Trajectory, read_trajectory, write_trajectory
from planning.formats.wpl import read_wpl, write_wpl

__all__ = [
    "GeoJsonPlan",
    "KmlTrack",
    "Trajectory",
    "read_flight",
    "read_geojson",
    "read_kml_track",
    "read_mission",
    "read_plan",
    "read_trajectory",
    "read_wpl",
    "write_geojson",
    "write_kml",
    "write_plan",
    "write_pois_csv",
    "write_trajectory",
    "write_wpl",
]
