"""Control steps per second, layer by layer."""
