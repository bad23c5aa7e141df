# Instrument file to calibrated channels on a uniform time axis, SI, nothing filtered.
# A record that cannot be used ends here as a row of checks.csv; the others go on.

INGEST = code_of("vinesexp.pipeline:ingest_record")


rule ingest:
    input:
        PLANNER.again("ingest", INGEST, PATHS.record),
        raw=raw_files,
    output:
        record=channels(PATHS.record("{record}")),
        checks=PATHS.ingest_checks("{record}"),
    log:
        PATHS.log("ingest", "{record}"),
    params:
        job=PLANNER.job("ingest", INGEST),
    message:
        "ingest     {wildcards.record}"
    shell:
        f"{ON_RECORD} {{params.job:q}}"
