"""Importing this has Python search for garbage seldom, here and in forks of this process.

After each 700 new objects, as by default, the searches take a sixth of the time in which libraries
are loaded, and a quarter of that of figures, which are made of many objects that stay to the end.
"""

import gc

gc.set_threshold(100_000)
