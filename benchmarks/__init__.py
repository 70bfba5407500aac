"""Benchmarks, run by `python -m benchmarks` (or `make bench`) from the root of the repository."""
