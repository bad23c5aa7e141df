"""Other people's records, read as a newcomer would: `python -m benchmarks.strangers FOLDER`.

Any folder of fetched files, of which none belongs to this repository
(docs/benchmarks/strangers.md lists those that were used). Every file goes through what `look`,
`init` and `check` say of it; where a free decay is found, its f0 and zeta are compared with a fit
of a few lines of numpy (`independent.py`) that shares no code with the package.
"""
