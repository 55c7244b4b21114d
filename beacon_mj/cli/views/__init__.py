"""What commands print: results on stdout, progress and remarks on stderr."""
