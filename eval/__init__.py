"""Evaluation: metrics, runner, statistics, tables."""
