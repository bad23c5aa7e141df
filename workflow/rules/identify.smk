# What one record says about M, c1, k1 and r; then all records together.

ESTIMATE = code_of("vinesexp.pipeline:estimate_from_record")
IDENTIFY = code_of("vinesexp.pipeline:identify", script="identify")


rule estimate:
    input:
        PLANNER.again("estimate", ESTIMATE, PATHS.estimates),
        record=PATHS.record("{record}"),
        conditioned=PATHS.conditioned("{record}"),
        impacts=PATHS.impacts("{record}"),
    output:
        estimates=PATHS.estimates("{record}"),
        decay=PATHS.decay("{record}"),
    log:
        PATHS.log("estimate", "{record}"),
    params:
        job=PLANNER.job("estimate", ESTIMATE),
    message:
        "estimate   {wildcards.record}"
    shell:
        f"{ON_RECORD} {{params.job:q}}"


rule identify:
    input:
        PLANNER.again("identify", IDENTIFY, PATHS.identified),
        estimates=each_record(PATHS.estimates),
        impacts=each_record(PATHS.impacts),
    output:
        identified=report(PATHS.identified, category="Tables"),
        budget=PATHS.rig_budget,
        levels=report(PATHS.level_values, category="Tables"),
        checks=PATHS.identify_checks,
    log:
        PATHS.log("identify"),
    params:
        about=PLANNER.about("identify", IDENTIFY),
    message:
        "identify   M, c1, k1, r from all records"
    script:
        "../scripts/identify.py"
