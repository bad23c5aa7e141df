"""What the model says: manifold, orbits, boundaries, b_c and b_t (docs/theory.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "b_c_exact": "vinesexp.theory.optimal_clearance",
        "b_c_published": "vinesexp.theory.optimal_clearance",
        "b_t_exact": "vinesexp.theory.optimal_clearance",
        "b_t_published": "vinesexp.theory.optimal_clearance",
        "predict_periodic": "vinesexp.theory.intervals",
        "predict_transient": "vinesexp.theory.intervals",
        "symmetric_orbits": "vinesexp.theory.floquet",
        "simulated_end": "vinesexp.theory.simulated_orbit",
        "fixed_points": "vinesexp.theory.slowflow",
        "amplitude": "vinesexp.theory.manifold",
        "best_clearance": "vinesexp.theory.transient",
        "Regime": "vinesexp.theory.regime_definitions",
        "regime_of": "vinesexp.theory.regime_definitions",
    },
)
