"""Proximal policy optimization as pure functions."""
