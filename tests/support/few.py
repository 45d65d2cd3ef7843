"""Settings of the smallest training: two iterations of small networks."""

FEW = (
    "iterations=2",
    "log_every=1",
    "ppo.unroll_length=6",
    "ppo.minibatches=2",
    "ppo.actor_layers=[16]",
    "ppo.critic_layers=[16]",
)
