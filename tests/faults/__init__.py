"""Faults of machines put into runs of the workflow: `python -m tests.faults --kills 50`.

`project.py` is a project to break and what its results should be, `injections.py` breaks it,
`__main__.py` does so many times and counts. Whatever was done to a run or to its results, one more
`snakemake` has to end with the bytes of a run that nothing happened to.
"""
