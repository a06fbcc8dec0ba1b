"""Change the plan that is open in a running ground station, wait for its proof, fetch its files.

hedgehop serve --demo    # prints a one-time sign-in link
python examples/drive_the_http_api.py 'http://127.0.0.1:8000/login?token=...' [--height-m 6] [--out mission.plan]
"""

import argparse
import contextlib
import http.cookiejar
import json
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Sequence
from pathlib import Path
from typing import Any


class Station:
    """The session lives in a cookie. Whatever changes something names its own origin, as a browser does."""

    def __init__(self, link: str) -> None:
        parts = urllib.parse.urlsplit(link)
        self.origin = f"{parts.scheme}://{parts.netloc}"
        self._opener = urllib.request.build_opener(
            urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor(http.cookiejar.CookieJar())
        )
        # The link leads on to the console, which need not be built here.
        with contextlib.suppress(urllib.error.HTTPError):
            self._opener.open(link).close()

    def ask(self, path: str, method: str = "GET", body: object = None) -> bytes:
        headers = {"Origin": self.origin, "Content-Type": "application/json"}
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{self.origin}/api/{path}", data, headers, method=method)
        with self._opener.open(request) as answer:
            return answer.read()

    def plan(self) -> dict[str, Any]:
        """Document, revision and how far its computation is."""
        return json.loads(self.ask("state"))["plan"]

    def computed(self) -> dict[str, Any]:
        """The open plan, once its newest revision has been worked out."""
        while True:
            plan = self.plan()
            answer = plan["computation"]
            if answer["revision"] >= plan["revision"] and answer["state"] != "running":
                return plan
            time.sleep(0.2)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("link", help="one-time sign-in link")
    parser.add_argument("--height-m", type=float, default=6.0, help="H of the ball that the surface is dilated with")
    parser.add_argument("--out", type=Path, help="the mission, for QGroundControl")
    given = parser.parse_args(arguments)

    station = Station(given.link)
    plan = station.computed()
    document = plan["document"]
    document["surface"]["height_m"] = given.height_m
    edit = {"base_revision": plan["revision"], "label": "Change the height", "document": document}
    station.ask("plan", "PUT", edit)
    answer = station.computed()["computation"]
    if (result := answer["result"]) is None:
        print(f"no plan: {answer['hint'] or answer['error']['what']}")
        return
    print(f"{document['name']}: {'certified' if result['certified'] else 'NOT certified'}")
    print(f"nearest {result['min_distance_m']:.2f} m, required {result['required_clearance_m']:.2f} m")
    print(f"{result['length_m']:.0f} m, {result['duration_s']:.0f} s, {result['waypoints']} waypoints")
    if given.out:
        given.out.write_bytes(station.ask("plan/export/mission.plan"))
        print(f"written to {given.out}")


if __name__ == "__main__":
    main()
