"""What the clearances of `vinesexp design` are worth, on random rigs."""
