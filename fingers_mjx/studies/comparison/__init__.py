"""Comparison of configurations over seeds: what a sweep shows, and what it lacks."""
