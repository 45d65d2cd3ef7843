"""The paper's claims: specifications of sweeps, and pages of what they showed."""
