"""Processes, clocks and links: what runs a policy on a hand."""
