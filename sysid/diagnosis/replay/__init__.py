"""Equation-error residuals along the measured motion."""
