"""Settings of tasks: what can be set, known before JAX and MuJoCo are loaded."""
