"""Engines: where the members of a sweep are trained, and what each has for itself."""
