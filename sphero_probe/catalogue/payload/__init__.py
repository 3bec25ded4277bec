"""Payloads: layouts in one line of text, fields, and the names of their values."""
