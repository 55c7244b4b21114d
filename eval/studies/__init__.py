"""Studies of many runs: sweeps, ablations, regret, certification, calibration."""
