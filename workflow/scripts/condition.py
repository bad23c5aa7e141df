"""One record, bandpassed."""

from pathlib import Path

from vinesexp.records.campaign import load_campaign
from vinesexp.signals.condition import condition
from vinesexp.step import run_step


def main(campaign: str, record: str, measured: str, out: str) -> str:
    loaded = load_campaign(Path(campaign))
    row = loaded.record(record)
    centre = 0.5 * (row.frequency[0] + row.frequency[1]) if row.frequency else None
    bands = condition(
        Path(measured), Path(out), bandpass=loaded.bandpass, f0_hint=centre, settings=row.settings
    )
    return f"{bands}" if bands else "passed on a record that cannot be used"


run_step(
    main,
    log=snakemake.log[0],
    campaign=snakemake.params.campaign,
    record=snakemake.wildcards.record,
    measured=snakemake.input.record,
    out=snakemake.output.conditioned,
)
