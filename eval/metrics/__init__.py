"""The metrics of one episode, and its row."""
