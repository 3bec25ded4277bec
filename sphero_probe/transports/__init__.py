"""Byte pipes to robots, each opened from one string."""
