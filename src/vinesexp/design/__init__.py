"""What clearance to build and what it gives: exact simulation of ensembles, theory beside it."""
