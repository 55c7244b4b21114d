"""Closed-form checks of the physics that the benchmark ships."""
