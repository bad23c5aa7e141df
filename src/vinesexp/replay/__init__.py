"""Every record simulated again with the identified rig."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(__name__, {"campaign_replay": ["replay_campaign"]})
