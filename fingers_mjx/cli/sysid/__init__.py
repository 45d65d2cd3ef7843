"""`fingers sysid`: one module for each of its actions."""
