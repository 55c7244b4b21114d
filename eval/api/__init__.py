"""What `beacon_mj` offers by name: one call for everything that a command does."""
