"""MuJoCo Playground with Brax PPO, on the hand."""
