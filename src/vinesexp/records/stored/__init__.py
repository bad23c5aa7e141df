"""Records and tables of a results folder, and whether they are up to date."""
