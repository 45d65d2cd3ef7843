"""Catalogue of what a real joint does and an ideal position servo does not."""
