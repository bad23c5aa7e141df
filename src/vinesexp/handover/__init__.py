"""Results in the forms of other programs: MAT, CSV, UFF 58, and metadata for an archive."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "write_mat": "vinesexp.handover.formats",
        "write_csv": "vinesexp.handover.formats",
        "write_uff": "vinesexp.handover.formats",
        "write_crate": "vinesexp.handover.crate",
    },
)
