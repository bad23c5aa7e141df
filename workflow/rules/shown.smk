# What a person looks at: figures, the pages of the records, the report, and all of it in one file.


rule figures_records:
    "Figures of single records."
    input:
        PLAN.before("figures_records"),
    output:
        PATHS.figures_records,
    log:
        PATHS.log("figures_records"),
    run:
        PLAN.run("figures_records")


rule figures_results:
    "Figures of the results."
    input:
        PLAN.before("figures_results"),
    output:
        PATHS.figures_results,
    log:
        PATHS.log("figures_results"),
    run:
        PLAN.run("figures_results")


rule pages:
    "The page that shows any record, and what it loads."
    input:
        PLAN.before("pages"),
    output:
        report(PATHS.records_page, category="Report"),
    log:
        PATHS.log("pages"),
    run:
        PLAN.run("pages")


rule report:
    "report.html: what was found, how sure it is, and what was wrong."
    input:
        PLAN.before("report"),
    output:
        report(PATHS.report, category="Report"),
    log:
        PATHS.log("report"),
    run:
        PLAN.run("report")


rule bundle:
    "On request, `snakemake bundle`: all that others may want, in one file."
    input:
        PLAN.before("bundle"),
    output:
        PATHS.bundle,
    log:
        PATHS.log("bundle"),
    run:
        PLAN.run("bundle")
