"""What outlives a run: journals, the folder that keeps them, and resuming."""
