"""Does a run prove its own numbers, and how much of it."""
