"""Radar detections followed from frame to frame: nearest neighbours and Kalman filters (Wessendorp 2021, III-B)."""
