"""Typed settings and strict YAML."""
