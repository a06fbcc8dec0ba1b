"""Flights during which the station's processes are killed, stopped and starved at random: ``make soak``."""
