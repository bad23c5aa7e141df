"""What clearance to build and what it gives: exact simulation of ensembles, theory beside it."""

import sys
from types import ModuleType
from typing import Any

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__, {"task": ["Task"], "advice": ["advise"], "ensemble": ["responses"]}
)


class _Room(ModuleType):
    """This room, which is also the question itself: ``vinesexp.design(mass=4.7, ...)``."""

    def __call__(self, **values: Any) -> Any:
        from vinesexp.design.ask import design

        return design(**values)


sys.modules[__name__].__class__ = _Room
