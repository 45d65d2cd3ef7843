"""Pushing an object to a target."""
