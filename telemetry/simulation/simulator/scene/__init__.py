"""What stands in the simulated world: ground and shapes that can be seen, hit and flown into."""

from telemetry.simulation.simulator.scene.ground_columns import SceneTerrain
from telemetry.simulation.simulator.scene.world import World

__all__ = ["SceneTerrain", "World"]
