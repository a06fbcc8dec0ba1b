"""What stands in the simulated world: ground and shapes that can be seen, hit and flown into."""

from telemetry.simulator.scene.terrain import SceneTerrain
from telemetry.simulator.scene.world import World

__all__ = ["SceneTerrain", "World"]
