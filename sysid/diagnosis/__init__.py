"""Which effects a measured log has that the simulation lacks."""
