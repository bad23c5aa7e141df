"""The columns of every table of a results folder: name, meaning, unit, type.

Names are a contract with users: they are added to, never changed.
"""

from __future__ import annotations

from enum import Enum

from vinesexp.records.stored.tables import Column, Table


class Verdict(Enum):
    """What the records say of something that was stated."""

    OK = "ok"
    NOT_TESTED = "not tested"
    OFF = "off"
    NOT_STATED = "not stated"


def _number(name: str, unit: str, meaning: str, form: str = "", *, needed: bool = True) -> Column:
    return Column(name, meaning, unit, "number", form, needed)


def _whole(name: str, meaning: str) -> Column:
    return Column(name, meaning, "", "whole")


_RECORD = Column("record", "id of the record")

#: impacts/<record>.csv.
IMPACTS = Table(
    "impacts", "impacts", file="impacts/RECORD.csv",
    answers="Time and strength of each impact: one row per impact.", columns=(
    _number("time_s", "s", "time of the impact on the record's axis", ".10f"),
    _whole("nes", "ball, from 1, in the order of clearance_mm; 0 where it is not known"),
    _whole("side", "+1 where x - y = +b, -1 at the other wall"),
    _number("velocity_jump_m_s", "m/s", "of the oscillator, from both channels", ".9g"),
    _number("peak_acceleration_m_s2", "m/s^2", "largest bandpassed sample", ".9g"),
    _number("confidence", "1", "probability that it is found again with other noise", ".9g"),
    _number("time_error_s", "s", "standard error", ".9g"),
    _number("velocity_jump_error_m_s", "m/s", "standard error", ".9g"),
    _number("jump_acceleration_m_s", "m/s", "jump by the area of the acceleration pulse", ".9g"),
    _number("jump_acceleration_error_m_s", "m/s", "standard error", ".9g"),
    _number("jump_displacement_m_s", "m/s", "jump by the slope change of displacement", ".9g"),
    _number("jump_displacement_error_m_s", "m/s", "standard error", ".9g"),
    _number("x_m", "m", "displacement at the impact", ".9g"),
    _number("v_before_m_s", "m/s", "velocity of the oscillator just before", ".9g"),
    _number("v_error_m_s", "m/s", "standard error", ".9g"),
    _number("nes_confidence", "1", "probability of nes", ".9g"),
    _whole("crowded", "1 where it overlaps another or fits badly"),
    _whole("clipped", "1 where the acceleration saturated"),
))  # fmt: skip

IDENTIFIED = Table(
    "identified", "identify", file="identified.csv",
    answers="Values of the rig: one row per parameter and method.", columns=(
    Column("parameter", "f0, zeta, M, c1, k1, r; r_1, r_2 for several balls"),
    _number("value", "", "in the unit of the column unit"),
    _number("std_error", "", "standard error, in the same unit"),
    _number("ci95_low", "", "lower end of the 95 % interval"),
    _number("ci95_high", "", "upper end of the 95 % interval"),
    Column("unit", "SI; 1 for a ratio"),
    Column("method", "how it was found; combined: the value that predictions use"),
    Column("records", "ids of the records used, separated by semicolons"),
))  # fmt: skip

#: Item of inputs.csv: a test whose base amplitude is another than that of its level.
BASE_OF_ONE = "base_amplitude of one test"
#: Stated values, tested by the records: one row per input.
INPUTS = Table(
    "inputs", "identify", file="inputs.csv",
    answers="Stated values, tested by the records: one row per input.", columns=(
    Column("item", "clearance, base_amplitude (of a level, or of one test), release, added_mass, "
           "nes_mass, mass, gain of a "
           "channel"),
    Column("record", "ids of the records that it was stated for; empty: the whole campaign"),
    Column("unit", "unit of the four numbers; 1 for a gain, which is the reading over the true "
            "value"),
    _number("stated", "", "in campaign.yaml or records.csv", ".7g", needed=False),
    _number("stated_error", "", "standard uncertainty: stated, or the default", ".3g",
            needed=False),
    _number("found", "", "from all records together, the stated value included", ".7g"),
    _number("found_error", "", "standard error", ".3g"),
    Column("verdict", "ok; not tested: the records do not determine the value; off: they "
           "contradict it, and the analysis uses the value found; not stated: the cell of "
           "records.csv is empty, and the analysis uses what the records show"),
))  # fmt: skip

BUDGET = Table(
    "budget", "compare", file="budget.csv",
    answers="Contributions to the errors of identified.csv.", columns=(
    Column("parameter", "the value to whose error the source contributes"),
    Column("source", "what contributes"),
    _number("contribution", "", "standard error from this source alone, SI"),
    _number("share", "1", "share of the variance"),
    Column("note", "what was assumed, and what would reduce it"),
))  # fmt: skip

#: f0 and zeta where the mass swings at each base amplitude; no row where they are the same at all.
LEVEL_VALUES = Table(
    "level_values", "identify", file="level_values.csv",
    answers="f0, zeta, c1 and k1 at the amplitude of each level.", columns=(
    _number("base_amplitude_mm", "mm", "base amplitude in records.csv", ".7g"),
    _number("amplitude_m", "m", "smallest mean amplitude of the mass in these tests", ".6g"),
    _number("f0_hz", "Hz", "natural frequency at that amplitude", ".10g"),
    _number("f0_error_hz", "Hz", "standard error, with the range around the amplitude", ".3g"),
    _number("zeta", "1", "damping ratio at that amplitude", ".7g"),
    _number("zeta_error", "1", "standard error, with the range around the amplitude", ".3g"),
    _number("c1_n_s_m", "N s/m", "damping of the linear oscillator of the same motion", ".7g"),
    _number("c1_error_n_s_m", "N s/m", "standard error", ".3g"),
    _number("k1_n_m", "N/m", "stiffness of the linear oscillator of the same motion", ".7g"),
    _number("k1_error_n_m", "N/m", "standard error", ".3g"),
))  # fmt: skip

RECORD_REGIMES = Table(
    "regimes", "regimes", file="regimes.csv",
    answers="Regime and amplitude: one row per record.", columns=(
    _RECORD,
    Column("regime", "by docs/theory.md; one per ball, separated by ' | '; a sweep: by frequency"),
    _number("impacts_per_cycle", "1", "impacts of all balls per cycle"),
    _number("amplitude_mean_m", "m", "mean over cycles of half the peak-to-peak displacement; of a "
            "periodic test without its start"),
    _number("amplitude_max_m", "m", "amplitude of the largest cycle"),
    _number("captured", "1", "share of cycles with one impact on either side", needed=False),
    _number("swing_first", "1", "half the range of the impacts' phase in the first half, in "
            "periods", needed=False),
    _number("swing", "1", "half the range of the impacts' phase in the second half, in "
            "periods", needed=False),
    _number("spells", "", "number of spells of captured cycles", needed=False),
    _number("spell_mean_s", "s", "mean length of a spell", needed=False),
    Column("impacts_per_cycle_each", "impacts per cycle of each ball, with ' | ' in between",
           needed=False),
    _number("amplitude_running_max_m", "m", "largest mean of a sweep over 0.1 Hz", needed=False),
    _number("length_s", "s", "length of the record without its "
            "gaps and edges", ".4g", needed=False),
    _number("amplitude_error_m", "m", "of a periodic test: standard error of amplitude_mean_m from "
            "cycle to cycle, without that of the sensitivity", ".4g", needed=False),
    _number("cycles", "", "number of cycles over which "
            "amplitude_mean_m is taken", ".0f", needed=False),
    _number("steady_from_s", "s", "of a periodic test: where these cycles begin, from the first "
            "sample; the start of the test comes before", ".4g", needed=False),
    _number("waited_s", "s", "of a periodic test whose record begins from rest: steady_from_s",
            ".4g", needed=False),
    Column("test", "as in records.csv", needed=False),
    Column("clearance_mm", "as in records.csv; of several balls, separated by semicolons",
           "mm", needed=False),
    _number("base_amplitude_mm", "mm", "as in records.csv", ".7g", needed=False),
))  # fmt: skip

#: How the base moved in each periodic test, from its own channel.
BASE = Table(
    "base", "regimes", file="base.csv",
    answers="How the base moved in each periodic test, from its own channel.", columns=(
    _RECORD,
    _number("frequency_hz", "Hz", "measured", ".10g"),
    _number("frequency_error_hz", "Hz", "standard error", ".3g"),
    _number("amplitude_m", "m", "of the displacement at that frequency", ".7g"),
    _number("amplitude_error_m", "m", "standard error, without that of the sensitivity", ".3g"),
    _number("harmonic_2", "1", "displacement at twice the frequency over amplitude_m", ".3g"),
    _number("harmonic_3", "1", "at three times the frequency", ".3g"),
    _number("wander", "1", "standard deviation of the amplitude over its mean", ".3g"),
    _number("dip", "1", "largest drop of the amplitude over its median", ".3g"),
))  # fmt: skip

#: What each ball does over the frequency of a sweep: one row a band.
BANDS = Table(
    "bands", "regimes", file="bands.csv",
    answers="A sweep over its frequency: one row per ball and band of response.", columns=(
    _RECORD,
    _whole("nes", "ball, from 1; 0: all balls, where they are not distinguished"),
    Column("response", "permanent, modulated or inactive (docs/signals.md)"),
    _number("from_hz", "Hz", "frequency at which it begins, in the order of time", ".5g"),
    _number("to_hz", "Hz", "frequency at which it ends", ".5g"),
    _number("from_s", "s", "time on the record's axis at which it begins", ".6g"),
    _number("to_s", "s", "time at which it ends", ".6g"),
    _whole("spells", "spells of two impacts per cycle in it"),
    _number("impacts_per_cycle", "1", "impacts of the ball per cycle", ".4g"),
    _number("amplitude_mean_m", "m", "mean over its cycles of half the swing", ".6g"),
    _number("amplitude_max_m", "m", "amplitude of the largest cycle", ".6g"),
))  # fmt: skip

#: When each ball of each release is captured and lost: one row a ball that is captured at all.
TRANSITIONS = Table(
    "transitions", "regimes", file="transitions.csv",
    answers="Where each ball of a release is captured and lost.", columns=(
    _RECORD,
    _whole("nes", "ball, from 1; 0: all balls, where they are not distinguished"),
    _number("clearance_mm", "mm", "clearance of the ball", ".6g"),
    _number("captured_from_s", "s", "start of its longest spell of two impacts per cycle", ".6g"),
    _number("captured_until_s", "s", "end of that spell", ".6g"),
    _number("from_m", "m", "amplitude at its start", ".6g"),
    _number("transition_m", "m", "amplitude at its end, where the ball is lost (T1)", ".6g"),
    _number("decay_rate_1_s", "1/s", "decay rate of the amplitude in between", ".6g"),
    _number("decay_rate_after_1_s", "1/s", "decay rate after captured_until_s", ".6g",
            needed=False),
))  # fmt: skip

#: How fast each release fell to each amplitude: one row a record and amplitude.
DECAY_TIMES = Table(
    "decay_times", "regimes", file="decay_times.csv",
    answers="How fast each release fell to each amplitude.", columns=(
    _RECORD,
    _number("target_m", "m", "amplitude to be reached"),
    _number("time_s", "s", "from the start until the amplitude stays below; empty: not reached"),
))  # fmt: skip

CLEARANCES = Table(
    "clearances", "compare", file="clearances.csv",
    answers="Best clearances, measured and predicted.", columns=(
    Column("test", "periodic or transient"),
    Column("level", "name of the row"),
    _number("measured_mm", "mm", "measured clearance", ".6g"),
    _number("measured_low_mm", "mm", "tried clearance below it, less its uncertainty", ".6g"),
    _number("measured_high_mm", "mm", "tried clearance above it, with its uncertainty", ".6g"),
    _number("published_mm", "mm", "b_c or b_t by the published formula", ".6g"),
    _number("exact_mm", "mm", "b_c or b_t without its approximations", ".6g"),
    _number("predicted_low_mm", "mm", "lower end of the 95 % interval of exact_mm", ".6g"),
    _number("predicted_high_mm", "mm", "upper end", ".6g"),
    _number("error_percent", "%", "exact_mm over measured_mm; empty for bounds, releases", ".6g"),
    _number("base_amplitude_mm", "mm", "of a periodic row", ".6g", needed=False),
    Column("kind", "lowest amplitude, end of two impacts per cycle, fastest decay", needed=False),
    Column("records", "ids of the records used, separated by semicolons", needed=False),
    Column("bound", "empty; 'at most', 'at least' or 'open' where the best clearance is at the "
           "edge of what was tried", needed=False),
    _number("stated_base_mm", "mm", "of a periodic row: base amplitude of records.csv", ".6g",
            needed=False),
    _number("release_mm", "mm", "of a transient row: where the mass is let go", ".6g",
            needed=False),
    _number("target_mm", "mm", "of a transient row: amplitude to be reached", ".6g", needed=False),
))  # fmt: skip

#: Every record beside what the identified rig does from several starts: one row a number.
REPLAY = Table(
    "replay", "replay", file="replay.csv",
    answers="Each record compared with a simulation of the identified rig.", columns=(
    _RECORD,
    Column("quantity", "amplitude, impacts per cycle, regime, spells or decay time"),
    Column("unit", "SI; 1 for a count"),
    Column("measured", "value of the record; empty where it shows none", kind="any", form=".6g"),
    # Digits beyond these depend on the order in which the simulation was compiled.
    Column("replayed", "mean over the replays of its regime; of a regime: those of all starts",
           kind="any", form=".6g"),
    _number("low", "", "smallest value of these replays", ".6g"),
    _number("high", "", "largest value of these replays", ".6g"),
    _number("deviation", "1", "measured over replayed, minus one", ".3g"),
    Column("outcome", "ok, differs, not measured or not replayed"),
    Column("starts", "regimes that the starts lead to, with their number, where these differ"),
))  # fmt: skip

CHECKS = Table(
    "checks", "checks", file="checks.csv",
    answers="Every problem found in the data: one row per problem.", columns=(
    Column("record", "id of the record; empty: the whole campaign"),
    Column("check", "what was checked"),
    Column("outcome", "ok, warning, refused or excluded"),
    Column("detail", "what was found, where, and what to do"),
))  # fmt: skip

TRUTH = Table(
    "truth", "score", file="truth.csv",
    answers="Simulated campaigns: what was found against the truth.", columns=(
    Column("what", "parameter or quantity of the impacts"),
    Column("record", "id of the record; empty: the whole campaign"),
    _number("truth", "", "value in the scene"),
    _number("found", "", "value that the analysis found"),
    _number("error", "", "found against the truth, in the unit of the column unit"),
    Column("unit", "unit of the column error; missed, false: counts of impacts"),
))  # fmt: skip

#: steps/<record>/decay.csv: amplitude of a ring-down beside what was identified from it.
DECAY = Table(
    "decay", "estimate", file="steps/records/RECORD/decay.csv",
    answers="The amplitude of a ring-down compared with the identified law.", columns=(
    _number("time_s", "s", "middle of a cycle, on the record's axis", ".10f"),
    _number("amplitude_m", "m", "half the swing of the cycle", ".9g"),
    _number("law_m", "m", "amplitude by the identified law of damping", ".9g"),
    _number("viscous_m", "m", "amplitude by the identified viscous damping alone", ".9g"),
))  # fmt: skip

#: Amplitude of each cycle of each record, measured and replayed.
REPLAY_CYCLES = Table(
    "replay_cycles", "replay", file="steps/replay_cycles.csv",
    answers="Amplitudes by cycle, measured and replayed.", columns=(
    _RECORD,
    _number("time_s", "s", "middle of the cycle from the beginning of the record", ".6g"),
    _number("measured_m", "m", "measured amplitude", ".5g"),
    _number("replayed_m", "m", "median of the replayed amplitude over the starts", ".5g"),
    _number("replayed_low_m", "m", "smallest over the starts", ".5g"),
    _number("replayed_high_m", "m", "largest over the starts", ".5g"),
))  # fmt: skip

#: truth/<record>.csv in a simulated campaign's folder.
TRUE_IMPACTS = Table(
    "true impacts", "simulate", file="truth/RECORD.csv in the campaign's folder",
    answers="Simulated campaigns: the true impacts of a record.", columns=(
    _number("time_s", "s", "true time on the record's axis"),
    _number("velocity_jump_m_s", "m/s", "velocity jump of the oscillator"),
))  # fmt: skip

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
