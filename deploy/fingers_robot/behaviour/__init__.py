"""Behaviours: where commands come from, and which policy runs."""
