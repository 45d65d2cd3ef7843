"""Nested models: candidates, fits, selection, intervals."""
