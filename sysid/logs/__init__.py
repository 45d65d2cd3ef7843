"""Measured logs: reading, columns, timing."""
