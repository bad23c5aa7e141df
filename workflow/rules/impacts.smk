# Acceleration spikes to impacts, and the regime that they and the amplitude show.

IMPACTS = code_of("vinesexp.pipeline:find_impacts")
COLLECT_REGIMES = code_of("vinesexp.pipeline:collect_regimes", script="regimes")


rule impacts:
    input:
        PLANNER.again("impacts", IMPACTS, PATHS.impacts),
        record=PATHS.record("{record}"),
        conditioned=PATHS.conditioned("{record}"),
    output:
        impacts=PATHS.impacts("{record}"),
        regime=PATHS.regime("{record}"),
    log:
        PATHS.log("impacts", "{record}"),
    params:
        job=PLANNER.job("impacts", IMPACTS),
    message:
        "impacts    {wildcards.record}"
    shell:
        f"{ON_RECORD} {{params.job:q}}"


rule regimes:
    input:
        PLANNER.again("regimes", COLLECT_REGIMES, PATHS.regimes),
        regimes=each_record(PATHS.regime),
    output:
        table=report(PATHS.regimes, category="Tables"),
        base=report(PATHS.base, category="Tables"),
        bands=report(PATHS.bands, category="Tables"),
        transitions=report(PATHS.transitions, category="Tables"),
        times=report(PATHS.decay_times, category="Tables"),
    log:
        PATHS.log("regimes"),
    params:
        about=PLANNER.about("regimes", COLLECT_REGIMES),
    message:
        "regimes    of all records"
    script:
        "../scripts/regimes.py"
