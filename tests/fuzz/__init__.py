"""Hostile files and signals, made by the hundred thousand: `python -m tests.fuzz --minutes 30`.

Seeds are small files of every format (`seeds.py`), and real ones where they lie beside the
repository. `mutations.py` damages them, `targets.py` gives them to the public code and judges,
`cases.py` runs one case by its name, `__main__.py` runs many and keeps what it finds.
"""
