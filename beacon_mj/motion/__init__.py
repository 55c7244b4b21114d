"""Search and motion on a known map: grids, D* Lite, exact paths, path tracking."""
