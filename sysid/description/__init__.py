"""What a log and an MJCF file say of drives: a first `drive.yaml`."""
