"""What planners with learned weights are composed of."""
