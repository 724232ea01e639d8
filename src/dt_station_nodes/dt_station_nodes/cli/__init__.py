"""The command line: one verb per file, imported only when asked for."""
