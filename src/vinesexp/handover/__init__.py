"""Results in the forms of other programs: MAT, CSV, UFF 58, and metadata for an archive."""
