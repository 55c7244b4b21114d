"""Runs: configuration, jobs, worker processes, the run folder, verification."""
