"""`vinesexp plan`: what to test next and why, or a first campaign from rig values."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.commands import options
from vinesexp.design.inputs import EXCITATION, RIG, gather
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.planning import campaign_plan as planned
from vinesexp.planning.campaign_plan import in_mm
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.records_csv import sheet_text
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.results import CampaignResults
from vinesexp.rig import Oscillator
from vinesexp.units import Quantity, parse_quantity

_OPTIONS = (*RIG, *(option for option in EXCITATION if option.symbol != "v0"))
#: Cells of a planned test that are shown, with their units.
_UNITS = (
    ("clearance_mm", "mm"),
    ("base_amplitude_mm", "mm base"),
    ("frequency_hz", "Hz"),
    ("added_mass_g", "g added"),
    ("release_mm", "mm release"),
)
#: Relative standard uncertainty of a value that states none, in a first plan.
_ASSUMED = 0.02


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A campaign that was run, or the values of a rig."""
    folder = "folder of a campaign with results"
    parser.add_argument("campaign", type=Path, nargs="?", metavar="CAMPAIGN", help=folder)
    target = ("--target SHARE", "bracket to reach, as a share of the clearance (2 %%)")
    options.add_options(parser, ("--results DIR", "results of the campaign (results/<campaign>)"))
    options.add_options(parser, target, default="2 %")
    options.add_options(parser, ("--records FILE", "write the tests as records.csv to fill in"))
    options.add_force(parser)
    options.add_values(parser, _OPTIONS, before="without a campaign: ")


def run(args: argparse.Namespace) -> int:
    """Print the plan; write its records.csv where one is asked for."""
    texts = {option.symbol: getattr(args, option.symbol) for option in _OPTIONS}
    given = [option.flag for option in _OPTIONS if texts[option.symbol] is not None]
    if args.campaign is not None and given:
        raise ParameterError("a campaign has its own rig; leave this out", where=given[0])
    if args.campaign is None and not given:
        raise ParameterError("name a campaign that was run, or give rig values, such as --mass")
    target = _share(args.target)
    options.refuse_existing(args.records, force=args.force)
    if args.campaign is not None:
        tests = _of_campaign(args.campaign, args.results, target)
    else:
        tests = _of_values(texts)
    if args.records is not None and tests:
        with options.writing(args.records):
            rows = [test.cells | {"note": test.why} for test in tests]
            args.records.write_text(sheet_text(rows), encoding="utf-8")
        print(f"written: {args.records}; fill in the files as they are measured")
    return 0


def _share(text: str) -> float:
    share = parse_quantity(text, "ratio").value
    if not 0.001 <= share <= 0.5:
        raise ParameterError(f"found '{text}', expected 0.1 % to 50 %", where="--target")
    return share


def _of_campaign(folder: Path, results: Path | None, target: float) -> list[planned.PlannedTest]:
    campaign = load_campaign(folder)
    results = Path("results") / campaign.name if results is None else results
    if not ResultPaths(results).identified.is_file():
        raise VinesexpError(
            f"holds no results; run vinesexp run {folder} first, or name them with --results",
            file=results,
        )
    found = CampaignResults(results, campaign)
    plans = planned.plan_levels(found, target=target)
    needs = planned.needs_of(found, plans)
    others = planned.plan_others(found, needs)
    tests = [*planned.next_tests(plans), *(test for other in others for test in other.next)]
    shown = {"plans": plans, "others": others, "tests": tests, "needs": needs, "target": target}
    print(options.text_of("plan.txt.j2", FILTERS, title=campaign.title, **shown))
    return tests


def grouped(tests: Sequence[planned.PlannedTest]) -> list[tuple[tuple[str, str], str]]:
    """Tests with one load and reason as one: both, and at which clearances or how many.

    Examples
    --------
    >>> test = planned.PlannedTest({"added_mass_g": "400"}, "M")
    >>> grouped([test, test, planned.PlannedTest({"clearance_mm": "27.3"}, "b_t")])
    [(('400 g added: ', 'M'), '2 more'), (('', 'b_t'), '27.3 mm')]
    """
    groups: dict[tuple[str, str], list[str]] = {}
    for test in tests:
        load = test.cells.get("added_mass_g")
        of = (f"{load} g added: " if load else "", test.why)
        groups.setdefault(of, []).append(test.cells.get("clearance_mm", ""))
    places = (", ".join(filter(None, own)) for own in groups.values())
    return [
        (of, f"{at} mm" if at else f"{len(groups[of])} more")
        for of, at in zip(groups, places, strict=True)
    ]


#: Of the templates of both plans.
FILTERS: options.Filters = {
    "mm": in_mm,
    "share": lambda share: f"{100.0 * share:.2g} %",
    "groups": grouped,
}


def _of_values(texts: dict[str, str | None]) -> list[planned.PlannedTest]:
    """A first campaign; values without an error count as known to 2 %."""
    given = gather(texts)
    missing = [o.flag for o in (*RIG, EXCITATION[0]) if o.symbol not in given]
    if missing:
        raise ParameterError(f"a plan needs {', '.join(missing)} too")

    def about(value: Quantity) -> Quantity:
        return value if value.std_error else replace(value, std_error=_ASSUMED * value.value)

    values = {o.symbol: about(given.one(o.symbol)) for o in RIG}
    host = Oscillator(M=values["M"].value, c1=values["c1"].value, k1=values["k1"].value)
    # The base will be tuned to the resonance as it is found, whatever M and k1 are.
    # So near to the resonance does a first ring-down let one tune the base.
    f0, zeta = Quantity(host.f0, 2e-4 * host.f0), Quantity(host.zeta, _ASSUMED * host.zeta)
    rig = IdentifiedRig(values, f0, zeta)
    frequency = given.one("frequency").value if "frequency" in given else host.f0
    release = abs(given.one("x0").value) if "x0" in given else None
    tests, valley = planned.first_tests(
        rig, G=about(given.one("G")), frequency=frequency, release=release
    )
    shown = {"tests": tests, "valley": valley, "units": _UNITS}
    print(options.text_of("first_plan.txt.j2", FILTERS, **shown))
    return tests
