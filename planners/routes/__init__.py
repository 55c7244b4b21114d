"""Reference planners that are told the route graph of a scene and its prior."""
