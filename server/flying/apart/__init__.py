"""Vehicles held apart, in the air and before a start; other aircraft drawn around them."""
