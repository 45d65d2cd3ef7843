"""Settings of PPO that all are given alike; the standard library alone."""

SETTINGS = {"unroll": 24, "epochs": 5, "minibatches": 4, "layers": [256, 128]}
"""Control steps per iteration, passes, parts of a pass, sizes of both networks."""
