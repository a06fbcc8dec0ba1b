"""Logs that vehicles write themselves: DataFlash of ArduPilot and ULog of PX4, as flight logs."""
