"""Takes a bare machine to a working station; standard library only, because it runs before anything is installed."""
