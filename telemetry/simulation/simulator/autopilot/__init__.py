"""The simulated autopilot: arming, modes, failsafes, missions."""
