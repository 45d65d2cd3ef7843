"""What is checked of a machine and its installation before anything heavy loads."""
