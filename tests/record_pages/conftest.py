"""The made-up campaign of the report's tests, with record pages."""

import pytest
from tests.report.made_up import Made, with_results

from vinesexp.record_pages.build import build_pages
from vinesexp.records.stored.result_paths import ResultPaths


@pytest.fixture(scope="session")
def full(once):
    """Every kind of test, with tables and pages, which need no figures."""

    def make(folder):
        campaign, results = with_results(folder)
        build_pages(campaign, paths=ResultPaths(results), code="a")
        return Made(campaign, results, [], "")

    return once("pages", make)
