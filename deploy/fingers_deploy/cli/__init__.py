"""The command `fingers-deploy`."""
