# Instrument file to calibrated channels on a uniform time axis, SI, nothing filtered: records/*.nc.
# A record that cannot be used ends here as a row of checks.csv; the others go on.


rule ingest:
    input:
        PLAN.before("ingest"),
    output:
        temp(PATHS.batch("ingest", "{batch}")),
    log:
        PATHS.log("ingest.{batch}"),
    message:
        "ingest     {wildcards.batch}"
    run:
        PLAN.run("ingest", log, output, batch=wildcards.batch)
