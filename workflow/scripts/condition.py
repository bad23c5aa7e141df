"""One record, bandpassed."""

from pathlib import Path

from vinesexp.signals.condition import condition
from vinesexp.step import run_step


def main(
    record: str,
    out: str,
    bandpass: tuple[float, float] | None,
    frequency: tuple[float, float] | None,
) -> str:
    centre = 0.5 * (frequency[0] + frequency[1]) if frequency else None
    bands = condition(Path(record), Path(out), bandpass=bandpass, f0_hint=centre)
    return f"{bands}" if bands else "passed on a record that cannot be used"


run_step(
    main,
    log=snakemake.log[0],
    record=snakemake.input.record,
    out=snakemake.output.conditioned,
    bandpass=snakemake.params.bandpass,
    frequency=snakemake.params.frequency,
)
