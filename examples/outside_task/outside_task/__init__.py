"""A task, a driver and a log reader from outside."""
