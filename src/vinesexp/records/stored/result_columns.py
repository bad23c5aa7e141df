"""The columns of every table of a results folder; docs/columns.md says what stands in each.

Names are a contract with users: they are added to, never changed.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum

from vinesexp.records.campaign.schema import Campaign, Record
from vinesexp.records.stored.tables import Row, Table, columns


class Verdict(Enum):
    """What the records say of something that was stated."""

    OK = "ok"
    NOT_TESTED = "not tested"
    OFF = "off"
    DOUBTFUL = "doubtful"
    NOT_STATED = "not stated"


IMPACTS = Table(
    "impacts", "impacts", file="impacts/RECORD.csv",
    answers="Time and strength of each impact: one row per impact.", columns=columns("""
        time_s:.10f nes:whole side:whole velocity_jump_m_s:.9g peak_acceleration_m_s2:.9g
        confidence:.9g time_error_s:.9g velocity_jump_error_m_s:.9g jump_acceleration_m_s:.9g
        jump_acceleration_error_m_s:.9g jump_displacement_m_s:.9g
        jump_displacement_error_m_s:.9g x_m:.9g v_before_m_s:.9g v_error_m_s:.9g
        v_shared_m_s:.9g read_later_s:.9g late_s:.9g late_error_s:.9g nes_confidence:.9g
        unseen_before:whole crowded:whole clipped:whole
    """))  # fmt: skip

IDENTIFIED = Table(
    "identified", "identify", file="identified.csv",
    answers="Values of the rig: one row per parameter and method.", columns=columns("""
        parameter value:number std_error:number ci95_low:number ci95_high:number unit method
        records
    """))  # fmt: skip

#: Item of inputs.csv: a test whose base amplitude is another than that of its level.
BASE_OF_ONE = "base_amplitude of one test"


def gain_of(role: str, setup: str) -> str:
    """Item of inputs.csv: what a channel reads over what is there; `setup` as in records.csv."""
    return f"{role} gain of {setup}" if setup else f"{role} gain"


def reading_of_metre(campaign: Campaign, record: Record, inputs: Iterable[Row]) -> float:
    """What the displacement of a record shows for 1 m, where the records contradict its channel.

    Without a laser it is the acceleration integrated.

    Parameters
    ----------
    campaign : Campaign
    record : Record
    inputs : iterable of mappings
        Rows of inputs.csv.
    """
    channels = campaign.setup_of(record).channels
    integrated = "displacement" not in channels and "acceleration" in channels
    item = gain_of("acceleration" if integrated else "displacement", record.setup)
    found = (
        float(row["found"]) for row in inputs
        if row["item"] == item and row["verdict"] == Verdict.OFF.value
    )  # fmt: skip
    return next(found, 1.0)


INPUTS = Table(
    "inputs", "identify", file="inputs.csv",
    answers="Stated values, tested by the records: one row per input.", columns=columns("""
        item record unit stated:.7g? stated_error:.3g? found:.7g found_error:.3g verdict
    """))  # fmt: skip

BUDGET = Table(
    "budget", "compare", file="budget.csv",
    answers="Contributions to the errors of identified.csv.", columns=columns("""
        parameter source contribution:number share:number note
    """))  # fmt: skip

#: f0 and zeta where the mass swings at each base amplitude; no row where they are the same at all.
LEVEL_VALUES = Table(
    "level_values", "identify", file="level_values.csv",
    answers="f0, zeta, c1 and k1 at the amplitude of each level.", columns=columns("""
        base_amplitude_mm:.7g amplitude_m:.6g f0_hz:.10g f0_error_hz:.3g zeta:.7g zeta_error:.3g
        c1_n_s_m:.7g c1_error_n_s_m:.3g k1_n_m:.7g k1_error_n_m:.3g
    """))  # fmt: skip

RECORD_REGIMES = Table(
    "regimes", "regimes", file="regimes.csv",
    answers="Regime and amplitude: one row per record.", columns=columns("""
        record regime impacts_per_cycle:number amplitude_mean_m:number amplitude_max_m:number
        captured:number? swing_first:number? swing:number? spells:number? spell_mean_s:number?
        impacts_per_cycle_each? amplitude_running_max_m:number? length_s:.4g?
        amplitude_error_m:.4g? cycles:.0f? steady_from_s:.4g? waited_s:.4g? released_m:.5g?
        begins_m:.5g? begins_error_m:.3g? test? clearance_mm? base_amplitude_mm:.7g?
    """))  # fmt: skip

#: How the base moved in each periodic test, from its own channel.
BASE = Table(
    "base", "regimes", file="base.csv",
    answers="How the base moved in each periodic test, from its own channel.", columns=columns("""
        record frequency_hz:.10g frequency_error_hz:.3g amplitude_m:.7g amplitude_error_m:.3g
        harmonic_2:.3g harmonic_3:.3g wander:.3g dip:.3g
    """))  # fmt: skip

#: What each ball does over the frequency of a sweep: one row a band.
BANDS = Table(
    "bands", "regimes", file="bands.csv",
    answers="A sweep over its frequency: one row per ball and band of response.",
    columns=columns("""
        record nes:whole response from_hz:.5g to_hz:.5g from_s:.6g to_s:.6g spells:whole
        impacts_per_cycle:.4g amplitude_mean_m:.6g amplitude_max_m:.6g
    """))  # fmt: skip

#: When each ball of each release is captured and lost: one row a ball that is captured at all.
TRANSITIONS = Table(
    "transitions", "regimes", file="transitions.csv",
    answers="Where each ball of a release is captured and lost.", columns=columns("""
        record nes:whole clearance_mm:.6g captured_from_s:.6g captured_until_s:.6g from_m:.6g
        transition_m:.6g decay_rate_1_s:.6g decay_rate_after_1_s:.6g?
    """))  # fmt: skip

#: How fast each release fell to each amplitude: one row a record and amplitude.
DECAY_TIMES = Table(
    "decay_times", "regimes", file="decay_times.csv",
    answers="How fast each release fell to each amplitude.", columns=columns("""
        record target_m:number time_s:number
    """))  # fmt: skip

CLEARANCES = Table(
    "clearances", "compare", file="clearances.csv",
    answers="Best clearances, measured and predicted.", columns=columns("""
        test level measured_mm:.6g measured_low_mm:.6g measured_high_mm:.6g published_mm:.6g
        exact_mm:.6g predicted_low_mm:.6g predicted_high_mm:.6g error_percent:.6g
        base_amplitude_mm:.6g? kind? records? bound? stated_base_mm:.6g? release_mm:.6g?
        target_mm:.6g?
    """))  # fmt: skip

#: Every record beside what the identified rig does from several starts: one row a number. More
#: digits of `replayed` depend on the order in which the simulation was compiled.
REPLAY = Table(
    "replay", "replay", file="replay.csv",
    answers="Each record compared with a simulation of the identified rig.", columns=columns("""
        record quantity unit measured:any:.6g replayed:any:.6g low:.6g high:.6g deviation:.3g
        outcome starts
    """))  # fmt: skip

CHECKS = Table(
    "checks", "checks", file="checks.csv",
    answers="Every problem found in the data: one row per problem.", columns=columns("""
        record check outcome detail
    """))  # fmt: skip

TRUTH = Table(
    "truth", "score", file="truth.csv",
    answers="Simulated campaigns: what was found against the truth.", columns=columns("""
        what record truth:number found:number error:number unit
    """))  # fmt: skip

#: steps/<record>/decay.csv: amplitude of a ring-down beside what was identified from it.
DECAY = Table(
    "decay", "estimate", file="steps/records/RECORD/decay.csv",
    answers="The amplitude of a ring-down compared with the identified law.", columns=columns("""
        time_s:.10f amplitude_m:.9g law_m:.9g viscous_m:.9g
    """))  # fmt: skip

#: Amplitude of each cycle of each record, measured and replayed.
REPLAY_CYCLES = Table(
    "replay_cycles", "replay", file="steps/replay_cycles.csv",
    answers="Amplitudes by cycle, measured and replayed.", columns=columns("""
        record time_s:.6g measured_m:.5g replayed_m:.5g replayed_low_m:.5g replayed_high_m:.5g
    """))  # fmt: skip

#: truth/<record>.csv in a simulated campaign's folder.
TRUE_IMPACTS = Table(
    "true impacts", "simulate", file="truth/RECORD.csv in the campaign's folder",
    answers="Simulated campaigns: the true impacts of a record.", columns=columns("""
        time_s:number velocity_jump_m_s:number
    """))  # fmt: skip

#: What a step on one record leaves for tables of all records, by the name it goes under there.
COLLECTED = {
    "regime": RECORD_REGIMES,
    "base": BASE,
    "bands": BANDS,
    "transitions": TRANSITIONS,
    "times": DECAY_TIMES,
}

#: The tables of one results folder by name, in the order in which they are made.
TABLES = {table.name: table for table in [*globals().values()] if isinstance(table, Table)}
