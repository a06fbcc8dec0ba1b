"""Radar detections followed from frame to frame: nearest neighbours and Kalman filters (Wessendorp 2021, III-B)."""

from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackerParams, TrackState

__all__ = ["TrackState", "Tracker", "TrackerParams"]
