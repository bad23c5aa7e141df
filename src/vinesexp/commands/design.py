"""`vinesexp design`: what clearance? b_c and b_t from rig values, with their intervals."""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import ParameterError, VinesexpError, nearest
from vinesexp.rig import Oscillator
from vinesexp.theory.intervals import (
    ClearancePrediction,
    predict_periodic,
    predict_transient,
)
from vinesexp.theory.optimal_clearance import release_amplitude
from vinesexp.units import Quantity, parse_quantity


@dataclass(frozen=True)
class Option:
    """A rig value: its symbol, its option, what it measures, and how one writes it."""

    symbol: str
    flag: str
    quantity: str
    example: str
    unit: str


#: In the order of the table.
RIG = (
    Option("M", "--mass", "mass", "4.7 kg", "kg"),
    Option("c1", "--damping", "damping", "3.02 N s/m", "N s/m"),
    Option("k1", "--stiffness", "stiffness", "1.147e4 N/m", "N/m"),
    Option("m", "--nes-mass", "mass", "32 g", "kg"),
    Option("r", "--restitution", "ratio", "0.6", ""),
)
#: The excitation.
EXCITATION = (
    Option("G", "--base-amplitude", "displacement", "0.25 mm", "m"),
    Option("x0", "--release", "displacement", "30 mm", "m"),
    Option("v0", "--release-velocity", "velocity", "0.1 m/s", "m/s"),
    Option("frequency", "--frequency", "frequency", "7.86 Hz", "Hz"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command; every number is written with its unit."""
    for option in (*RIG, *EXCITATION):
        parser.add_argument(
            option.flag, dest=option.symbol, metavar="VALUE", help=f"such as '{option.example}'"
        )
    parser.add_argument(
        "--identified",
        type=Path,
        metavar="CSV",
        help="identified.csv of a campaign, in place of numbers (its rows with method 'combined')",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object for programs")
    parser.add_argument(
        "--plot", type=Path, metavar="FILE", help="picture of the SIM (svg, pdf or png)"
    )


def run(args: argparse.Namespace) -> int:
    """Answer on standard output; the exit code is 0 or the error is one line."""
    given = gather(args)
    answer = design(given)
    if args.plot is not None:
        _plot(args.plot, given, answer)
    print(json.dumps(answer.as_json(), indent=2) if args.json else table(given, answer))
    return 0


def gather(args: argparse.Namespace) -> dict[str, Quantity]:
    """The values given, from options and identified.csv; an option wins over the file.

    Raises
    ------
    ParameterError
        A value that cannot be read, or what is still missing, all of it in one line.
    """
    given = read_identified(args.identified) if args.identified is not None else {}
    for option in (*RIG, *EXCITATION):
        text = getattr(args, option.symbol)
        if text is None:
            continue
        try:
            given[option.symbol] = parse_quantity(text, option.quantity)
        except ParameterError as error:
            raise ParameterError(error.problem, where=option.flag) from None
    _ask_for_missing(given)
    for symbol in ("G", "x0"):
        if symbol in given and given[symbol].value == 0.0:
            flag = next(o.flag for o in EXCITATION if o.symbol == symbol)
            raise ParameterError(
                "found 0: without excitation there is no best clearance", where=flag
            )
    return given


def _ask_for_missing(given: Mapping[str, Quantity]) -> None:
    def wanted(options: list[Option]) -> str:
        return ", ".join(f"{o.flag} '{o.example}'" for o in options)

    if "G" not in given and "x0" not in given:
        excitation = [o for o in EXCITATION if o.symbol in ("G", "x0")]
        missing = [o for o in RIG if o.symbol not in given]
        also = f"; also give {wanted(missing)}" if missing else ""
        raise ParameterError(
            f"nothing to design for: give {' or '.join(wanted([o]) for o in excitation)}{also}"
        )
    symbols = {o.symbol for o in RIG} if "G" in given else {"r"}
    if "v0" in given:
        symbols |= {"M", "k1"}
    missing = [o for o in RIG if o.symbol in symbols and o.symbol not in given]
    if missing:
        raise ParameterError(f"values are missing: give {wanted(missing)}")


def read_identified(path: Path) -> dict[str, Quantity]:
    """M, c1, k1 and r with standard errors from an identified.csv (rows `combined`).

    Raises
    ------
    VinesexpError
        Unreadable file, a missing column, or a row that is no number.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            rows = list(reader)
            columns = reader.fieldnames or []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise VinesexpError(
            f"cannot be read ({reason}); give an identified.csv", file=path
        ) from None
    for column in ("parameter", "value", "std_error", "unit", "method"):
        if column not in columns:
            raise VinesexpError(
                f"no column '{column}'; {nearest(column, columns or ['none'])}", file=path
            )
    found: dict[str, Quantity] = {}
    options = {option.symbol: option for option in RIG}
    for line, row in enumerate(rows, start=2):
        symbol = "r" if row["parameter"] == "r_1" else row["parameter"]
        if symbol not in options or row["method"] != "combined" or symbol in found:
            continue
        error_text = row["std_error"] or "0"
        text = f"{row['value']} +- {error_text} {row['unit'].strip() if symbol != 'r' else ''}"
        try:
            found[symbol] = parse_quantity(text, options[symbol].quantity)
        except ParameterError as error:
            raise VinesexpError(error.problem, file=path, where=f"line {line}") from None
    if not found:
        raise VinesexpError("holds no row with method 'combined' of M, c1, k1 or r", file=path)
    return found


@dataclass(frozen=True)
class Answer:
    """What `design` found; lengths in m, None where the excitation was not given."""

    A_1: float
    A_2: float
    F_c: float | None
    b_c: ClearancePrediction | None
    b_t: ClearancePrediction | None

    def as_json(self) -> dict[str, float | None]:
        """The contract's keys; null where the excitation it needs was not given."""

        def mm(prediction: ClearancePrediction | None, kind: str) -> float | None:
            return None if prediction is None else 1e3 * float(getattr(prediction, kind))

        return {
            "A_1": self.A_1,
            "A_2": self.A_2,
            "F_c": self.F_c,
            "b_c_published_mm": mm(self.b_c, "published"),
            "b_c_exact_mm": mm(self.b_c, "exact"),
            "b_t_published_mm": mm(self.b_t, "published"),
            "b_t_exact_mm": mm(self.b_t, "exact"),
        }


def design(given: Mapping[str, Quantity]) -> Answer:
    """Clearances from the values of `gather`."""
    from vinesexp.theory.manifold import A_1, A_2
    from vinesexp.theory.slowflow import threshold

    rig = {o.symbol: given[o.symbol] for o in RIG if o.symbol in given}
    value = {symbol: quantity.value for symbol, quantity in given.items()}
    F_c = None
    if len(rig) == len(RIG):
        # refuses what has no meaning before anything is computed
        oscillator = Oscillator(M=value["M"], c1=value["c1"], k1=value["k1"])
        if not value["m"] > 0.0:
            raise ParameterError(f"found {value['m']} kg, expected above zero", where="--nes-mass")
        lam = oscillator.c1 / (value["m"] * oscillator.w0)
        F_c = float(threshold(lam=lam, r=value["r"]))
    b_c = b_t = None
    if "G" in given:
        frequency = value.get("frequency")
        b_c = predict_periodic(G=value["G"], values=rig, frequency=frequency)
    if "x0" in given:
        x0, v0 = value["x0"], value.get("v0", 0.0)
        b_t = predict_transient(x0=abs(x0), v0=v0, values=rig)
    return Answer(A_1=float(A_1(value["r"])), A_2=float(A_2(value["r"])), F_c=F_c, b_c=b_c, b_t=b_t)


def table(given: Mapping[str, Quantity], answer: Answer) -> str:
    """The readable answer: rig, clearances, how they were got, sensitivities."""
    lines = ["Rig", *_rig_lines(given, answer), "", "Clearances (one-sided b)"]
    lines.append(f"  {'':18}{'published':>12}{'exact':>12}   95 % interval of the exact value")
    lines += _clearance_lines(given, answer)
    lines += ["", "Sensitivities of the exact values"]
    lines += _sensitivity_lines(given, answer)
    return "\n".join(lines)


def _rig_lines(given: Mapping[str, Quantity], answer: Answer) -> list[str]:
    lines = []
    for option in RIG:
        if option.symbol in given:
            q = given[option.symbol]
            error = f" +- {q.std_error:.3g}" if q.std_error else ""
            lines.append(f"  {option.symbol:3} = {q.value:.6g}{error} {option.unit}".rstrip())
    if answer.F_c is not None:
        rig = {name: given[name].value for name in ("M", "c1", "k1", "m")}
        o = Oscillator(M=rig["M"], c1=rig["c1"], k1=rig["k1"])
        eps = rig["m"] / o.M
        lines.append(
            f"  f0 = {o.f0:.4f} Hz, zeta = {o.zeta:.3g}, eps = {eps:.4g}, "
            f"lambda = {2.0 * o.zeta / eps:.4g}"
        )
    F_c = "" if answer.F_c is None else f", F_c = {answer.F_c:.5f}"
    lines.append(f"  A_1 = {answer.A_1:.5f} (T1), A_2 = {answer.A_2:.5f} (T2; paper: 0.6){F_c}")
    return lines


def _clearance_lines(given: Mapping[str, Quantity], answer: Answer) -> list[str]:
    lines = []

    def line(label: str, p: ClearancePrediction) -> str:
        interval = (
            f"{1e3 * p.low:.3f} to {1e3 * p.high:.3f} mm" if p.std_error else "no error bars given"
        )
        return f"  {label:18}{1e3 * p.published:9.3f} mm{1e3 * p.exact:9.3f} mm   {interval}"

    if answer.b_c is not None:
        lines.append(line(f"b_c, G = {1e3 * given['G'].value:.4g} mm", answer.b_c))
    if answer.b_t is not None:
        lines.append(line(f"b_t, x_m = {1e3 * _x_m(given):.4g} mm", answer.b_t))
    if answer.b_c is not None:
        lines.append("  b_c: formula (36); exact: end of the stable orbit (Floquet multipliers)")
    else:
        lines.append("  b_c: give --base-amplitude")
    if answer.b_t is not None:
        lines.append("  b_t: x_m/0.6, formula (37); exact: x_m/A_2(r), T2 in closed form")
    else:
        lines.append("  b_t: give --release")
    return lines


def _x_m(given: Mapping[str, Quantity]) -> float:
    M, k1 = (given[n].value if n in given else 1.0 for n in ("M", "k1"))
    v0 = given["v0"].value if "v0" in given else 0.0
    return float(release_amplitude(x0=given["x0"].value, v0=v0, M=M, k1=k1))


def _sensitivity_lines(given: Mapping[str, Quantity], answer: Answer) -> list[str]:
    predictions = {
        name: p for name, p in (("b_c", answer.b_c), ("b_t", answer.b_t)) if p is not None
    }
    heads = "".join(f"{f'd {n}/d value':>20}{'for +1 %':>12}" for n in predictions)
    lines = [f"  {'value':8}{heads}"]
    for option in RIG:
        if option.symbol not in given:
            continue
        cells = ""
        for p in predictions.values():
            slope = 1e3 * p.gradient[option.symbol] + 0.0  # no minus zero
            unit = f"mm/({option.unit})" if option.unit else "mm"
            unit = unit.replace("(kg)", "kg")
            change = 0.01 * slope * given[option.symbol].value
            change = 0.0 if math.isclose(change, 0.0, abs_tol=1e-12) else change
            cells += f"{f'{slope:.5g} {unit}':>20}{f'{change:+.3f} mm':>12}"
        lines.append(f"  {option.symbol:8}{cells}")
    return lines


def _plot(path: Path, given: Mapping[str, Quantity], answer: Answer) -> None:
    from vinesexp.figures.draw.style import write
    from vinesexp.figures.draw.theory_curves import sim_with_working_points

    formats = (".svg", ".pdf", ".png")
    if path.suffix.lower() not in formats:
        raise VinesexpError(
            f"cannot draw '{path.suffix}'; name a file that ends in {', '.join(formats)}", file=path
        )
    points: dict[str, tuple[float, float | None]] = {}
    if answer.b_c is not None:
        points["b_c"] = (answer.b_c.exact, _amplitude_at_b_c(given, answer.b_c.exact))
    if answer.b_t is not None:
        points["b_t"] = (answer.b_t.exact, _x_m(given))
    write(sim_with_working_points(r=given["r"].value, points=points), path)


def _amplitude_at_b_c(given: Mapping[str, Quantity], b: float) -> float:
    """Amplitude of the orbit a hair inside its end, m."""
    from vinesexp.theory.rig_orbits import symmetric_orbits

    frequency = given["frequency"].value if "frequency" in given else None
    rig = {o.symbol: given[o.symbol].value for o in RIG}
    return symmetric_orbits(G=given["G"].value, b=b * (1.0 - 1e-9), frequency=frequency, **rig)[
        0
    ].amplitude
