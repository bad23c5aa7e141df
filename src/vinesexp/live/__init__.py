"""While measuring: files analysed as instruments write them, and a page that follows."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(__name__, {"session": ["Session"], "server": ["serve"]})
