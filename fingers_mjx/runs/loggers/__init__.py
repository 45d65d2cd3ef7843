"""Loggers: where a learning curve goes beside `metrics.jsonl`."""
