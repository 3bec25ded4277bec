"""The formats of payloads: layouts, their fields, and the names of values."""
