"""What to test next, and what a first campaign should hold: `vinesexp plan`."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__, {"campaign_plan": ["plan_levels", "needs_of"], "next_clearance": ["follow_plan"]}
)
