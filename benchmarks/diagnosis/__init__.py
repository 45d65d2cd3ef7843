"""How often a diagnosis is right: hidden effects, public logs, the battery."""
