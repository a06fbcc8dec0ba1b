"""The examples below each command's ``--help``."""

from __future__ import annotations


def _examples(*pairs: tuple[str, str]) -> str:
    """One paragraph per line, because the help joins the lines of a paragraph."""
    lines = ["Examples:"]
    for purpose, command in pairs:
        lines += [f"{purpose}:", f"  {command}"]
    return "\n\n".join(lines)


EXIT_CODES = "Exit codes: 0 done, 1 not certified, not feasible or failed, 2 wrong input."
SERVE = _examples(
    ("A first look, with the demo terrain", "hedgehop serve --demo"),
    ("The same, the radar simulated from its samples on", "hedgehop serve --demo --radar iq"),
    ("For tablets in the network, after hedgehop tls", "hedgehop serve --host 0.0.0.0"),
    ("Another port and place for the data", "hedgehop serve --port 8010 --data-dir ~/flights"),
)
TLS = _examples(
    ("Once, before the station serves a network", "hedgehop tls"),
    ("Also reached under another name and address", "hedgehop tls --name gcs.example --name 192.168.1.20"),
    ("Then", "hedgehop serve --host 0.0.0.0"),
)
STATIONS = _examples(
    ("Two stations and a router", "hedgehop stations router.example --station Alpha --station Bravo --out fleet"),
    ("A third one later", "hedgehop stations router.example --station Charlie --out fleet"),
)
AUDIT = _examples(
    ("Is the log of commands whole", "hedgehop audit ~/.local/share/hedgehop"),
    ("As a table too", "hedgehop audit ~/.local/share/hedgehop --csv commands.csv"),
)
ACCOUNT_ADD = _examples(
    ("Somebody who looks on", "hedgehop account add Olga --role observer"),
    ("A second pilot", "hedgehop account add Otto --role operator"),
)
ACCOUNT_LINK = _examples(
    ("Into your own station again", "hedgehop account link"),
    ("For somebody else", "hedgehop account link Olga"),
)
ACCOUNT_PASSWORD = _examples(("Asked for twice", "hedgehop account password Otto"))
ACCOUNT_REMOVE = _examples(("Out at once", "hedgehop account remove Olga"))
ACCOUNT_LIST = _examples(("Who may sign in", "hedgehop account list"))
PLAN = _examples(
    ("A mission over the points of a file", "hedgehop plan dsm.tif pois.csv --out flight --rtl-height-m 60"),
    ("Closer to the ground, with RTK", "hedgehop plan dsm.tif pois.kml --out flight --profile mapper-rtk --height-m 3"),
    ("For a script", "hedgehop plan dsm.tif pois.csv --out flight --json > flight.json"),
)
CERTIFY = _examples(
    ("A mission from any ground station", "hedgehop certify dsm.tif mission.plan --position-error-m 0.1"),
    ("Every leg, not only the worst", "hedgehop certify dsm.tif mission.waypoints --verbose"),
)
RISK = _examples(
    ("How likely a flight is to touch the ground", "hedgehop risk dsm.tif flight/mission.plan"),
    ("Of a hundred thousand flights, on all cores", "hedgehop risk dsm.tif flight/mission.plan --flights 100000 "
     "--cluster local"),
    ("With errors that wander less", "hedgehop risk dsm.tif mission.waypoints --correlation-m following=50"),
)  # fmt: skip
SURVEY = _examples(
    ("An area at 1 cm per pixel", "hedgehop survey dsm.tif area.geojson --out flight --gsd-cm 1"),
    ("25 m above the surface, lines from west to east", "hedgehop survey dsm.tif area.kml --out flight "
     "--height-m 25 --angle-deg 90"),
    ("As many flights as the battery asks for, side by side", "hedgehop survey dsm.tif area.geojson --out flights "
     "--parts auto --cluster local"),
)  # fmt: skip
UPLOAD = _examples(
    ("Over a telemetry radio", "hedgehop upload flight/mission.waypoints --link /dev/ttyUSB0:57600"),
    ("For a script", "hedgehop upload flight/mission.plan --link udpin:0.0.0.0:14550 --json"),
)
FENCE = _examples(
    ("A fence that you drew, onto the vehicle", "hedgehop fence udpin:0.0.0.0:14550 upload fence.kml"),
    ("What is on board, as a plan for QGroundControl", "hedgehop fence /dev/ttyUSB0:57600 download onboard.plan"),
    ("Away with it", "hedgehop fence udpin:0.0.0.0:14550 clear"),
)
RALLY = _examples(
    ("Places to return to", "hedgehop rally udpin:0.0.0.0:14550 upload rally.plan"),
    ("For a script", "hedgehop rally udpin:0.0.0.0:14550 download rally.geojson --json"),
)
FLY = _examples(
    ("A planned mission, checked against its surface model", "hedgehop fly flight/mission.waypoints "
     "--link udpin:0.0.0.0:14550 --dsm dsm.tif"),
    ("Waypoint by waypoint, kept on file", "hedgehop fly flight/mission.waypoints --link tcp:10.0.0.7:5760 "
     "--mode guided --dsm dsm.tif --record flight.mcap"),
)  # fmt: skip
PARAMS_GET = _examples(
    ("One", "hedgehop params get RTL_ALT --link udpin:0.0.0.0:14550"),
    ("By pattern, with units and help", "hedgehop params get 'FENCE_*' --link /dev/ttyUSB0:57600 --about apm.pdef.xml"),
    ("For a script", "hedgehop params get --link tcp:10.0.0.7:5760 --json > parameters.json"),
)
PARAMS_SET = _examples(
    ("One", "hedgehop params set RTL_ALT 1900 --link udpin:0.0.0.0:14550"),
    ("Several", "hedgehop params set WPNAV_SPEED 300 LAND_SPEED 40 --link udpin:0.0.0.0:14550"),
)
PARAMS_SAVE = _examples(
    ("For Mission Planner and MAVProxy", "hedgehop params save before.param --link udpin:0.0.0.0:14550"),
    ("For QGroundControl", "hedgehop params save before.params --link udpin:0.0.0.0:14550"),
)
PARAMS_LOAD = _examples(
    ("What differs", "hedgehop params load before.param --link udpin:0.0.0.0:14550"),
    ("Without calibrations, which belong to one vehicle", "hedgehop params load other.param --leave-out 'COMPASS_*' "
     "--leave-out 'INS_*' --link udpin:0.0.0.0:14550"),
)  # fmt: skip
PARAMS_REVIEW = _examples(
    ("On a plan, over its surface model", "hedgehop params review flight/mission.waypoints --dsm dsm.tif "
     "--link udpin:0.0.0.0:14550"),
    ("For any low flight", "hedgehop params review --link udpin:0.0.0.0:14550"),
)  # fmt: skip
LOGS_LIST = _examples(
    ("All of them", "hedgehop logs list --link udpin:0.0.0.0:14550"),
    ("For a script", "hedgehop logs list --link /dev/ttyACM0:115200 --json"),
)
LOGS_GET = _examples(
    ("That of the last flight", "hedgehop logs get newest --link udpin:0.0.0.0:14550 --out logs"),
    ("One of the list", "hedgehop logs get 17 --link /dev/ttyACM0:115200"),
)
LIBRARY_PUSH = _examples(
    ("To a stick, before the drive home", "hedgehop library push /media/crew/stick"),
    ("What would go to a store", "hedgehop library push s3://survey/hedgehop --dry-run"),
    ("What is there read again, and mended", "hedgehop library push /media/crew/stick --check"),
)
LIBRARY_PULL = _examples(
    ("Onto the laptop in the office", "hedgehop library pull /media/crew/stick"),
    ("Into another data directory, for a script", "hedgehop library pull s3://survey/hedgehop --data-dir all --json"),
)
LIBRARY_LIST = _examples(("What a stick holds", "hedgehop library list /media/crew/stick"))
TERRAIN_CATALOGUE = _examples(
    ("Which models can be used, and which of them first", "hedgehop terrain catalogue maps/"),
    ("Which one counts at a place", "hedgehop terrain catalogue maps/collection.json --at 37.7300,14.9900"),
)
TERRAIN_DILATE = _examples(
    ("The surface that lines keep above, as a raster", "hedgehop terrain dilate dsm.tif --radius-m 5 --height-m 3 "
     "--out dilated.tif"),
    ("Of a country, on all cores", "hedgehop terrain dilate country.tif --out dilated.tif --cluster local"),
)  # fmt: skip
PARAMS_COMPARE = _examples(
    ("With a file", "hedgehop params compare before.param --link udpin:0.0.0.0:14550"),
    ("With another vehicle", "hedgehop params compare tcp:10.0.0.8:5760 --link tcp:10.0.0.7:5760"),
)
HOME = _examples(
    ("Where the vehicle is", "hedgehop home here"),
    ("Would home there be clear to return to", "hedgehop home -37.1245,175.6893 --check"),
    ("The second vehicle's, for a script", "hedgehop home here --vehicle 2 --json"),
)
GOTO = _examples(
    ("Up to 8 m, and hold there", "hedgehop goto udpin:0.0.0.0:14550 take-off --dsm dsm.tif --height-m 8"),
    (
        "To a place, 6 m above what stands there",
        "hedgehop goto udpin:0.0.0.0:14550 to -37.1245,175.6893 --dsm dsm.tif --height-m 6",
    ),
    (
        "Would an orbit be clear",
        "hedgehop goto udpin:0.0.0.0:14550 orbit -37.1245,175.6893 --dsm dsm.tif --radius-m 15 --check",
    ),
    ("Home over the surface, and down", "hedgehop goto udpin:0.0.0.0:14550 home --dsm dsm.tif"),
)
SIM = _examples(
    ("A vehicle for a ground station on this machine", "hedgehop sim --link udpout:127.0.0.1:14550 "
     "--home -37.1244507,175.6892879,803.15"),
    ("Ten times as fast, among the hills", "hedgehop sim --link tcpin:127.0.0.1:5760 "
     "--home -37.1244507,175.6892879,803.15 --speedup 10 --dsm dsm.tif --parameter RTL_ALT=7000"),
)  # fmt: skip
REVIEW = _examples(
    ("A recording, over its surface model", "hedgehop review flight.mcap --dsm dsm.tif"),
    ("Another ground station's log", "hedgehop review flight.tlog --dsm dsm.tif --mission mission.waypoints --json"),
)
MAP = _examples(
    ("What the radar saw, for a point cloud viewer", "hedgehop map flight.mcap --sensor radar --out radar.ply"),
    ("The highest obstacles as a raster", "hedgehop map flight.mcap --sensor radar --out radar.tif --json"),
    (
        "Of every flight of a season, on all cores",
        "hedgehop map flights --all --sensor radar --out maps",
    ),
    ("Of a robot's bag", "hedgehop map run.bag --sensor radar --points /radar/points --pose /odom --out radar.ply"),
)
BAG = _examples(
    ("What a ROS 1 bag holds", "hedgehop bag run.bag"),
    ("A ROS 2 bag's folder, for a script", "hedgehop bag rosbag2_2026_05_01-10_00_00 --json"),
    ("As a recording, for Review", "hedgehop bag run.bag --points /radar/points --home-alt-amsl-m 432 --out run.mcap"),
)
AGENT = _examples(
    ("A TI radar at its two serial ports", "hedgehop agent https://gcs.example --token-file sensor-token.txt "
     "--ti-config radar.cfg --ti-data /dev/ttyACM1"),
    ("From a driver that writes lines of JSON", "radar_driver | hedgehop agent https://gcs.example "
     "--token-file sensor-token.txt"),
    ("A recorded flight's frames once more", "hedgehop agent http://10.0.0.5:8000 --token-file sensor-token.txt "
     "--recording flight.mcap --json"),
    ("A robot's lidar, by ROS 2", "hedgehop agent https://gcs.example --token-file sensor-token.txt --ros2 "
     "--points /lidar/points --sensor vision --pose /odom"),
)  # fmt: skip
ROS2_TOPICS = _examples(
    ("The robot on this machine", "hedgehop ros2 topics"),
    ("Another one, for a script", "hedgehop ros2 topics --router 10.0.0.7 --domain 3 --json"),
)
ROS2_PUBLISH = _examples(
    ("Beside a running station", "hedgehop ros2 publish"),
    ("To a robot of humble elsewhere", "hedgehop ros2 publish --router 10.0.0.7 --domain 3 --humble"),
)
RADAR_PROCESS = _examples(
    ("A capture of TI's DCA1000 card", "hedgehop radar process adc_data_Raw_0.bin --cfg AWR1843config.cfg --plots "
     "figures"),
    ("The ODA data set, as a recording", "hedgehop radar process radar.csv --sensor position2go --out targets.mcap"),
    ("For a script", "hedgehop radar process cube.npy --sensor awr1843 --json > detections.json"),
)  # fmt: skip
RADAR_TRACKS = _examples(
    ("Two poles, drawn as the paper draws them", "hedgehop radar tracks radar.csv optitrack.csv --pole 0.4,-2.5 "
     "--pole -0.3,-4.5 --plots figures"),
)  # fmt: skip
CLOUD = _examples(
    ("Cells as the density has it", "hedgehop cloud survey.laz --out dsm.tif"),
    ("A robot's cloud, in metres around a place", "hedgehop cloud scan.pcd --out dsm.tif --cell-m 0.25 "
     "--crs '+proj=tmerc +lat_0=37.7290 +lon_0=14.9926 +units=m'"),
)  # fmt: skip
EXPORT = _examples(("A flight for ROS 2's tools", "hedgehop export flight.mcap --ros2 flight-ros2.mcap"))
TRAVERSABILITY = _examples(
    ("Where a rover can drive, as rasters", "hedgehop traversability dsm.tif --out ground"),
    ("Foliage cleared by a radar, landing sites near a point", "hedgehop traversability dsm.tif --uwb drive.npz "
     "--near 37.72902,14.99262 --rotor-span-m 0.8 --out ground --json"),
    ("Of a model larger than memory, on all cores", "hedgehop traversability country.tif --resolution-m 0.5 "
     "--out ground.tif --cluster local"),
)  # fmt: skip
BENCH = _examples(("Best of five, ratios in one run", "hedgehop bench"))
SCENARIO = _examples(
    ("A building in the way, by each sensor alone, at night and without GNSS", "hedgehop scenario castle-building"),
    ("Fifty seeds, for a script", "hedgehop scenario castle-building --seeds 50 --json > castle.json"),
    ("A thousand, on all cores", "hedgehop scenario castle-building --seeds 1000 --cluster local"),
    ("Objects of your own, the flight kept on file", "hedgehop scenario wood --world park.json --record park.mcap"),
)
