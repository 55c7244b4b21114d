"""What the Bug algorithms share: the boundary of free space, and following it."""
