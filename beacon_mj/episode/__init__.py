"""One episode: protocol, sensor, the loop and its trace, and the conformance checks."""
