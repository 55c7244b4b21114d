"""Families in which learning by touch is worth something, and by how much."""
