"""Planners: one a file, behind one interface."""
