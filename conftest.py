"""What every process of the tests starts with; numpy is not loaded yet when pytest reads this."""

import os
import sys

from vinesexp.threads import one_thread_each

one_thread_each()

# Tests start hundreds of processes, and run in several: none compiles what another has compiled.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
