"""What the model says: manifold, orbits, boundaries, b_c and b_t (docs/theory.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "optimal_clearance": ["b_c_exact", "b_c_published", "b_t_exact", "b_t_published"],
        "intervals": ["predict_periodic", "predict_transient"],
        "floquet": ["symmetric_orbits"],
        "simulated_orbit": ["simulated_end"],
        "slowflow": ["fixed_points"],
        "manifold": ["amplitude"],
        "transient": ["best_clearance"],
        "regime_definitions": ["Regime", "regime_of"],
    },
)
