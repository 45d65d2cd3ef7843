"""Pressing keys: which key when, key events, and the finger that presses."""
