"""Unknowns that are known apart from one another."""

import numpy as np

from vinesexp.identification.joint.covariance import Covariance


def independent(*errors: float) -> Covariance:
    """The covariance of unknowns with these standard errors."""
    return Covariance((), np.diag(errors))
