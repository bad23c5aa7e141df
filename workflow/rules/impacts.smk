# Acceleration spikes to impacts, and the regime that they and the amplitude show.


rule impacts:
    input:
        record=PATHS.record("{record}"),
        conditioned=PATHS.conditioned("{record}"),
    output:
        impacts=PATHS.impacts("{record}"),
        regime=PATHS.regime("{record}"),
    log:
        RESULTS / "logs/impacts/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        depends=record_text,
        code=code_digest(
            "vinesexp.signals.impacts.find",
            "vinesexp.signals.regimes",
            "vinesexp.signals.base_motion",
        ),
    message:
        "impacts    {wildcards.record}"
    script:
        "../scripts/impacts.py"


rule regimes:
    input:
        regimes=each_record(PATHS.regime("{record}")),
    output:
        table=PATHS.regimes,
        base=PATHS.base,
        times=PATHS.decay_times,
    log:
        RESULTS / "logs/regimes.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
    message:
        "regimes    of all records"
    script:
        "../scripts/regimes.py"
