# Acceleration spikes to impacts, and the regime that they and the amplitude show.


rule impacts:
    input:
        record=RESULTS / "records/{record}.nc",
        conditioned=RESULTS / "conditioned/{record}.nc",
    output:
        impacts=RESULTS / "impacts/{record}.csv",
        regime=step("regime.json"),
    log:
        RESULTS / "logs/impacts/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        depends=record_text,
        code=code_digest("vinesexp.signals.impacts.find", "vinesexp.signals.regimes"),
    message:
        "impacts    {wildcards.record}"
    script:
        "../scripts/impacts.py"


rule regimes:
    input:
        regimes=each_record(step("regime.json")),
    output:
        table=RESULTS / "regimes.csv",
        times=RESULTS / "decay_times.csv",
    log:
        RESULTS / "logs/regimes.log",
    message:
        "regimes    of all records"
    script:
        "../scripts/regimes.py"
