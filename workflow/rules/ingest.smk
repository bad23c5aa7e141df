# Instrument file to calibrated channels on a uniform time axis, SI, nothing filtered.
# A record that cannot be used ends here as a row of checks.csv; the others go on.

INGEST = code_of("vinesexp.pipeline:ingest_record", script="ingest")


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
        about=PLANNER.about("ingest", INGEST),
    message:
        "ingest     {wildcards.record}"
    script:
        "../scripts/ingest.py"
