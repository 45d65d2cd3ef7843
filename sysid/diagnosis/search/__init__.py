"""The search for causes: stages, selection, and the judge of what counts."""
