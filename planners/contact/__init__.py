"""What planners that touch on purpose are composed of."""
