"""Statistics over rows: intervals, pairing, comparison, summaries, gates."""
