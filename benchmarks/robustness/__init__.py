"""Campaigns of rigs that are not the model, analysed by the whole pipeline and scored.

The rig, its sensors and its campaign folders are simulated here anew: nothing of the package's
solver or virtual laboratory is used, so that an error of theirs cannot hide itself.
"""
