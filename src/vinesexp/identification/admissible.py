"""Estimates that are none: of copies of a record, and values that no rig can have."""

from __future__ import annotations

from collections.abc import Sequence

from vinesexp.identification.estimate import Estimate, is_known
from vinesexp.records.campaign import Campaign
from vinesexp.records.checks import Check
from vinesexp.units import COVERAGE_95

#: r of a contact without a bounce: an error below half of it says so.
_NO_BOUNCE = 0.1


def without_copies(
    found: Sequence[Estimate], campaign: Campaign
) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those of records that hold the same samples as an earlier one.

    `content` is a digest of a record's channels, in its note.
    """
    first: dict[str, str] = {}
    copies: dict[str, str] = {}
    for e in found:
        if e.parameter == "content":
            original = first.setdefault(e.note, e.records[0])
            if original != e.records[0]:
                copies[e.records[0]] = original
    rows = {record.id: record for record in campaign.records}
    checks = []
    for name, original in copies.items():
        a, b = rows.get(name), rows.get(original)
        said_alike = a is not None and b is not None and (
            (a.test, a.clearance, a.base_amplitude, a.frequency, a.added_mass, a.release)
            == (b.test, b.clearance, b.base_amplitude, b.frequency, b.added_mass, b.release)
        )  # fmt: skip
        detail = f"holds the same samples as {original}; counted once"
        if not said_alike:
            detail += f", with the row of {original}: what records.csv says of the two differs"
        checks.append(Check(name, "copy", "warning", detail))
    kept = [e for e in found if e.parameter != "content" and not set(e.records) & set(copies)]
    return kept, checks


def possible(estimates: Sequence[Estimate]) -> tuple[list[Estimate], list[Check]]:
    """Estimates without those that no rig can have or that nobody knows, and why.

    Masses, stiffnesses, dampings and frequencies are above zero, restitutions from 0 to 1, and a
    value with an error of more than half of it is none.
    """
    kept, checks = [], []
    for e in estimates:
        restitution = e.parameter == "r" or (
            e.parameter.startswith("r_") and e.parameter[2:].isdigit()
        )
        positive = e.parameter.removesuffix("_added") in ("f0", "zeta", "M", "c1", "k1")
        if (positive and not e.value > 0.0) or (restitution and not 0.0 <= e.value <= 1.0):
            expected = "a number from 0 to 1" if restitution else "a number above zero"
            detail = (
                f"{e.parameter} = {e.value:.4g} {e.unit} ({e.method}) is impossible, expected "
                f"{expected}; left out: check what records.csv and campaign.yaml say of these tests"
            )
        elif (positive and not is_known(e.value, e.std_error)) or (
            # A contact without a bounce has r near zero, which a small error of its own says.
            restitution and not is_known(max(e.value, _NO_BOUNCE), e.std_error)
        ):
            detail = (
                f"{e.parameter} ({e.method}) is not known: {e.value:.4g} +- "
                f"{COVERAGE_95 * e.std_error:.2g} {e.unit}, expected a standard error of half "
                "the value at most; left out"
            )
        else:
            kept.append(e)
            continue
        record = e.records[0] if len(e.records) == 1 else ""
        checks.append(Check(record, "impossible", "warning", detail))
    return kept, checks
