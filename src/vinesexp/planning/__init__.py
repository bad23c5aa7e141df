"""What to test next, and what a first campaign should hold: `vinesexp plan`."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "plan_levels": "vinesexp.planning.campaign_plan",
        "needs_of": "vinesexp.planning.campaign_plan",
        "follow_plan": "vinesexp.planning.next_clearance",
    },
)
