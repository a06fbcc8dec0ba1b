"""Processes of their own: link, recorder, replay, simulator."""
