"""Pressing keys."""
