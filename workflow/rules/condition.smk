# Zero-phase bandpass: the oscillator's motion, and the band in which impacts live: conditioned/*.nc.


rule condition:
    input:
        PLAN.before("condition"),
    output:
        temp(PATHS.batch("condition", "{batch}")),
    log:
        PATHS.log("condition.{batch}"),
    message:
        "condition  {wildcards.batch}"
    run:
        PLAN.run("condition", log, output, batch=wildcards.batch)
