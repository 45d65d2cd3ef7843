"""The tasks: crawl, keyboard, push, recovery."""
