# Acceleration spikes to impacts, impacts/*.csv, and the regime that they and the amplitude show.


rule impacts:
    input:
        PLAN.before("impacts"),
    output:
        temp(PATHS.batch("impacts", "{batch}")),
    log:
        PATHS.log("impacts.{batch}"),
    message:
        "impacts    {wildcards.batch}"
    run:
        PLAN.run("impacts", log, output, batch=wildcards.batch)


rule regimes:
    input:
        PLAN.before("regimes"),
    output:
        table(PATHS.regimes),
        table(PATHS.base),
        table(PATHS.bands),
        table(PATHS.transitions),
        table(PATHS.decay_times),
    log:
        PATHS.log("regimes"),
    message:
        "regimes    of all records"
    run:
        PLAN.run("regimes", log, output)
