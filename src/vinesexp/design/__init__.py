"""What clearance to build and what it gives: exact simulation of ensembles, theory beside it."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "Task": "vinesexp.design.task",
        "advise": "vinesexp.design.advice",
        "responses": "vinesexp.design.ensemble",
    },
)
