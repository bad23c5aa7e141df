# What one record says about M, c1, k1 and r; then all records together.


rule estimate:
    input:
        PLAN.before("estimate"),
    output:
        temp(PATHS.batch("estimate", "{batch}")),
    log:
        PATHS.log("estimate.{batch}"),
    message:
        "estimate   {wildcards.batch}"
    run:
        PLAN.run("estimate", log, output, batch=wildcards.batch)


rule identify:
    input:
        PLAN.before("identify"),
    output:
        table(PATHS.identified),
        table(PATHS.inputs),
        table(PATHS.level_values),
        PATHS.rig,
        PATHS.rig_budget,
        PATHS.identify_checks,
    log:
        PATHS.log("identify"),
    message:
        "identify   M, c1, k1, r from all records"
    run:
        PLAN.run("identify", log, output)
