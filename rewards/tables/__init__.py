"""Reward tables of the tasks."""
