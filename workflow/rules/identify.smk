# What one record tells about M, c1, k1 and r; then all records together.


rule estimate:
    input:
        record=RESULTS / "records/{record}.nc",
        conditioned=RESULTS / "conditioned/{record}.nc",
        impacts=RESULTS / "impacts/{record}.csv",
    output:
        estimates=step("estimates.json"),
    log:
        RESULTS / "logs/estimate/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        depends=record_text,
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.identification.one_record"),
    message:
        "estimate   {wildcards.record}"
    script:
        "../scripts/estimate.py"


rule identify:
    input:
        estimates=each_record(step("estimates.json")),
    output:
        identified=RESULTS / "identified.csv",
        checks=RESULTS / "steps/identify.csv",
    log:
        RESULTS / "logs/identify.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.identification.combine"),
    message:
        "identify   M, c1, k1, r from all records"
    script:
        "../scripts/identify.py"
