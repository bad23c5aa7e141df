# Zero-phase bandpass: the oscillator's motion, and the band in which impacts live.


rule condition:
    input:
        record=PATHS.record("{record}"),
    output:
        conditioned=PATHS.conditioned("{record}"),
    log:
        RESULTS / "logs/condition/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        bandpass=CAMPAIGN.bandpass,
        frequency=lambda wildcards: CAMPAIGN.record(wildcards.record).frequency,
        settings=lambda wildcards: repr(CAMPAIGN.record(wildcards.record).settings),
        code=code_digest("vinesexp.signals.condition"),
    message:
        "condition  {wildcards.record}"
    script:
        "../scripts/condition.py"
