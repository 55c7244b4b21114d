"""Certified scenes from a family template and a seed."""
