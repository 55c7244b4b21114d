"""What planners are built from that are told the truth: reference planners only."""
