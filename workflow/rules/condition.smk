# Zero-phase bandpass: the oscillator's motion, and the band in which impacts live.


rule condition:
    input:
        record=RESULTS / "records/{record}.nc",
    output:
        conditioned=RESULTS / "conditioned/{record}.nc",
    log:
        RESULTS / "logs/condition/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        bandpass=CAMPAIGN.bandpass,
        frequency=lambda wildcards: CAMPAIGN.record(wildcards.record).frequency,
        settings=lambda wildcards: repr(CAMPAIGN.record(wildcards.record).settings),
        code=code_digest("vinesexp.signals.condition"),
    message:
        "condition  {wildcards.record}"
    script:
        "../scripts/condition.py"
