"""Results in the forms of other programs: MAT, CSV, UFF 58, and metadata for an archive."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__, {"formats": ["write_mat", "write_csv", "write_uff"], "crate": ["write_crate"]}
)
