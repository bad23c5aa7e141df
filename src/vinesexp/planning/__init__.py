"""What to test next, and what a first campaign should hold: `vinesexp plan`."""
