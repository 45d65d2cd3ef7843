"""How the joints of the simulated hand are driven."""
