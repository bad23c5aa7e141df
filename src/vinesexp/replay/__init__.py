"""Every record simulated again with the identified rig."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "replay_campaign": "vinesexp.replay.campaign_replay",
    },
)
