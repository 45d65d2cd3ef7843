"""A simulator of its own that hides effects, so that a diagnosis is not judged by itself."""
