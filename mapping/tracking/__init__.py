"""Radar detections followed from frame to frame: nearest neighbours and Kalman filters (Wessendorp 2021, III-B)."""

from mapping.tracker.model import TrackerParams, TrackState
from mapping.tracker.tracker import Tracker

__all__ = ["TrackState", "Tracker", "TrackerParams"]
