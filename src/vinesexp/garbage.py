"""Importing this has Python search for garbage seldom, here and in forks of this process.

Python searches after each 700 new objects by default. Libraries and figures are made of many
objects that stay to the end, and each search goes through them in vain.
"""

import gc

gc.set_threshold(100_000)
