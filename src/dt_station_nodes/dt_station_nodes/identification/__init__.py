"""Model estimation from runs, and controller tuning: pure functions of arrays."""
