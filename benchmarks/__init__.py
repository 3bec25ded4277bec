"""Ratios beside the peers, measured in one run: ``python -m benchmarks`` from the root of the repository."""
