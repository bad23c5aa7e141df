# A page that shows any record, and what it loads: one job, which leaves alone what is still right.


rule pages:
    input:
        PLAN.before("pages"),
    output:
        report(PATHS.records_page, category="Report"),
    log:
        PATHS.log("pages"),
    message:
        "pages      of all records"
    run:
        PLAN.run("pages", log, output)
