# Zero-phase bandpass: the oscillator's motion, and the band in which impacts live.

CONDITION = code_of("vinesexp.pipeline:condition_record")


rule condition:
    input:
        PLANNER.again("condition", CONDITION, PATHS.conditioned),
        record=PATHS.record("{record}"),
    output:
        conditioned=channels(PATHS.conditioned("{record}")),
    log:
        PATHS.log("condition", "{record}"),
    params:
        job=PLANNER.job("condition", CONDITION),
    message:
        "condition  {wildcards.record}"
    shell:
        f"{ON_RECORD} {{params.job:q}}"
