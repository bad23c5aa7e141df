"""`vinesexp plan`: what to test next and why, or a first campaign from rig values."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from vinesexp.clearance.predicted import IdentifiedRig
from vinesexp.commands import options
from vinesexp.design.inputs import EXCITATION, RIG, gather
from vinesexp.errors import ParameterError, VinesexpError
from vinesexp.figures.numbers import rounded
from vinesexp.planning import campaign_plan as planned
from vinesexp.planning.campaign_plan import in_mm
from vinesexp.planning.expected_valley import Valley
from vinesexp.records.campaign.load import load_campaign
from vinesexp.records.campaign.records_csv import sheet_text
from vinesexp.records.stored.result_paths import ResultPaths
from vinesexp.results import CampaignResults
from vinesexp.rig import Oscillator
from vinesexp.units import Quantity, parse_quantity

_OPTIONS = (*RIG, *(option for option in EXCITATION if option.symbol != "v0"))
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
    lines = [f"{campaign.title}: what to test next"]
    if not plans:
        lines.append(
            "no periodic tests yet; rig values without a campaign give a first plan of them: "
            "vinesexp plan --mass '4.7 kg' and the others (vinesexp plan --help)"
        )
    for plan in plans:
        lines += _level_lines(plan, target)
    needs = planned.needs_of(found, plans)
    others = planned.plan_others(found, needs)
    for other in others:
        lines += _other_lines(other)
    tests = [*planned.next_tests(plans), *(test for other in others for test in other.next)]
    if not tests and plans:
        lines += ["", "enough: no further test of these kinds would change the answers"]
    print("\n".join([*lines, "", *_needs_lines(needs)]))
    return tests


def _level_lines(plan: planned.LevelPlan, asked: float) -> list[str]:
    """One level: where it stands, what to test, what that leaves."""
    now = plan.width_now
    state = f"lowest amplitude bracketed within {100 * (now or 0.0):.2g} %"
    state = "its lowest amplitude is at the edge of what was tried" if now is None else state
    lines = ["", f"{plan.level.name}: {plan.in_words}" + (f", {state}" if plan.tested else "")]
    if plan.valley is None:
        lines.append("  the identified rig does not say where the minimum lies")
    else:
        low, high = plan.valley.interval
        expected = f"{in_mm(plan.valley.lowest)} ({in_mm(low)} to {in_mm(high)} mm, 95 %)"
        lines.append(f"  expected by the identified rig: {expected}")
        lines.append(_scatter_line(plan, asked))
    if plan.next:
        reported = ", ".join(in_mm(b) for b in plan.next)
        lines.append(f"  test next, in this order: {reported} mm")
        lines.append(
            "  run and plan again after each one, because its result changes the next ones"
        )
    elif now is not None:
        lines.append("  nothing more to test at this base amplitude")
    if plan.bracket is not None and plan.next:
        low, best, high = plan.bracket
        width, left = 100 * (high - low) / best, f"{in_mm(low)} to {in_mm(high)} mm"
        lines.append(f"  if the rig is as identified, these leave {left} ({width:.2g} %)")
    return lines


def _other_lines(plan: planned.OtherPlan) -> list[str]:
    """One kind of test beside the periodic ones: where it stands, what is still to be tested."""
    lines = ["", f"{plan.name}: {plan.state}"]
    if not plan.next:
        return [*lines, "  enough"]
    groups: dict[tuple[str, ...], list[str]] = {}
    for test in plan.next:
        cells = test.cells
        load = f"{cells['added_mass_g']} g added: " if cells.get("added_mass_g") else ""
        groups.setdefault((load, test.why), []).append(cells.get("clearance_mm", ""))
    for (load, why), clearances in groups.items():
        at = ", ".join(b for b in clearances if b)
        what = f"{at} mm" if at else f"{len(clearances)} more"
        lines.append(f"  test next: {load}{what} ({why})")
    return lines


def _scatter_line(plan: planned.LevelPlan, asked: float) -> str:
    scatter = f"{100 * plan.scatter:.2g} %"
    if not math.isfinite(plan.target):
        return f"  the minimum is too flat for amplitudes that scatter by {scatter}: repeat tests"
    if plan.target > asked:
        return (
            f"  amplitudes scatter by {scatter}: a bracket below {100 * plan.target:.2g} % would "
            "be decided by chance; longer or repeated records narrow it"
        )
    return f"  amplitudes scatter by {scatter}: little enough for a bracket of {100 * asked:.2g} %"


def _needs_lines(needs: planned.Needs) -> list[str]:
    lines = ["Records and instruments"]
    if needs.settle is not None and needs.record is not None:
        lines.append(
            f"  wait {rounded(needs.settle)} s after switching on, then record "
            f"{rounded(needs.record)} s"
        )
    if needs.swing:
        lines.append(
            f"  displacement: a range of +-{1.3e3 * needs.swing:.2g} mm (largest seen x 1.3)"
        )
    if needs.acceleration is not None:
        lines.append(
            f"  acceleration: a range of +-{rounded(1.3 * needs.acceleration)} m/s^2 (largest "
            f"impact x 1.3); {needs.clipped} of {needs.impacts} impacts saturated"
        )
    if needs.impacts:
        share = 100.0 * needs.sure / needs.impacts
        enough = "the sampling suffices" if share > 90.0 else "sample faster, or lower the noise"
        lines.append(f"  {share:.0f} % of the impacts are certain: {enough}")
    return lines


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
    print("\n".join(_first_lines(tests, valley)))
    return tests


def _first_lines(tests: Sequence[planned.PlannedTest], valley: Valley | None) -> list[str]:
    lines = ["A first campaign"]
    if valley is None:
        lines.append("no clearance gives two impacts per cycle here: see vinesexp design")
    else:
        low, high = valley.interval
        ends = f"{in_mm(low)} to {in_mm(high)} mm, 95 %"
        lines.append(f"lowest amplitude expected at {in_mm(valley.lowest)} mm ({ends})")
    for test in tests:
        cells = test.cells
        what = [cells["test"]]
        for key, unit in (
            ("clearance_mm", "mm"),
            ("base_amplitude_mm", "mm base"),
            ("frequency_hz", "Hz"),
            ("added_mass_g", "g added"),
            ("release_mm", "mm release"),
        ):
            if cells.get(key):
                what.append(f"{cells[key]} {unit}")
        lines.append(f"  {cells['record']:<14} {', '.join(what)}: {test.why}")
    return [*lines, "then: vinesexp run, and vinesexp plan CAMPAIGN for the next clearances"]
