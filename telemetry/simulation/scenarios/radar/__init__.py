"""Reflectors, a wood and a ruin before a radar (Miccinesi 2022)."""
