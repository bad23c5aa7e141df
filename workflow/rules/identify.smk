# What one record tells about M, c1, k1 and r; then all records together.


rule estimate:
    input:
        record=PATHS.record("{record}"),
        conditioned=PATHS.conditioned("{record}"),
        impacts=PATHS.impacts("{record}"),
    output:
        estimates=PATHS.estimates("{record}"),
    log:
        RESULTS / "logs/estimate/{record}.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        depends=record_text,
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.identification.one_record"),
    message:
        "estimate   {wildcards.record}"
    script:
        "../scripts/estimate.py"


rule identify:
    input:
        estimates=each_record(PATHS.estimates("{record}")),
    output:
        identified=PATHS.identified,
        budget=PATHS.budget,
        checks=PATHS.identify_checks,
    log:
        RESULTS / "logs/identify.log",
    params:
        campaign=str(CAMPAIGN_FOLDER),
        results=str(RESULTS),
        known=repr(CAMPAIGN.known),
        code=code_digest("vinesexp.identification.whole_campaign"),
    message:
        "identify   M, c1, k1, r from all records"
    script:
        "../scripts/identify.py"
