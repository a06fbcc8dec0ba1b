"""What the sensors of a recording saw, as the pages see it while it is played."""

from __future__ import annotations

from server.heard.relay import Relay
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_watch import Watch
from server.obstacles.traffic import TrafficWatch
from server.schemas import Pages
from telemetry.topics.messages import Topic

MAPS = (Topic.MAP_RADAR, Topic.MAP_VISION, Topic.MAP_VISION_FLIGHT, Topic.MAP_RANGES)
STATUSES = (Topic.PERCEPTION_RADAR, Topic.PERCEPTION_VISION, Topic.PERCEPTION_RANGES)


class Replayed:
    """One recording is open at a time, whichever vehicle flew it."""

    def __init__(self, pages: Pages) -> None:
        self.watch = Watch("replay", pages)
        self.tracks = TracksWatch("replay", pages, self.watch)
        self.traffic = TrafficWatch("replay", pages)

    def forget(self) -> None:
        """Another recording, or none."""
        self.watch.forget()
        self.tracks.forget()
        self.traffic.forget()

    def hear(self, relay: Relay) -> None:
        """From the bus that the replay node is on."""
        for topic in MAPS:
            relay.on(topic, self.watch.on_map, replayed=True, each=True)
        for topic in STATUSES:
            relay.on(topic, self.watch.on_status, replayed=True)
        relay.on(Topic.RADAR_LOOK, self.watch.on_radar_look, replayed=True)
        relay.on(Topic.CLOUD_LOOK, self.watch.on_cloud_look, replayed=True)
        relay.on(Topic.ALERT, self.watch.on_alert, replayed=True, each=True)
        relay.on(Topic.AVOIDANCE, self.watch.on_avoidance, replayed=True)
        relay.on(Topic.TRACKS, self.tracks.on_status, replayed=True)
        relay.on(Topic.TRAFFIC, self.traffic.on_status, replayed=True)
