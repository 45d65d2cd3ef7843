"""The command `fingers`: one module for each of its commands."""
