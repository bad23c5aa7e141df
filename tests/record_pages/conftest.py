"""The made-up campaign of the report's tests."""

import importlib.util
import sys
from pathlib import Path

import pytest

_HOME = Path(__file__).parents[1] / "report" / "conftest.py"
_SPEC = importlib.util.spec_from_file_location("campaigns_for_pages", _HOME)
assert _SPEC is not None
assert _SPEC.loader is not None
made_up = sys.modules["campaigns_for_pages"] = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(made_up)


@pytest.fixture(scope="session")
def full(tmp_path_factory):
    """Every kind of test, with tables; pages need no figures."""
    folder = tmp_path_factory.mktemp("pages")
    campaign = made_up.synthetic.make_campaign(folder / "rig", made_up.synthetic.FULL)
    parameters = tuple(made_up.synthetic.VALUES)
    made_up.synthetic.make_results(campaign, folder / "results", parameters=parameters)
    return made_up.Made(campaign, folder / "results", [], "")
