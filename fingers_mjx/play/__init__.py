"""An exported policy in C MuJoCo, through the robot's own code."""
