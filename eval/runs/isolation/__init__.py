"""A planner in a process of its own: what crosses, the child, and who watches it."""
