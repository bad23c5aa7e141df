# Figures of single records and of the results, and the page that holds them.

FIGURES = code_of("vinesexp.figures.gallery", script="figures")
REPORT = code_of("vinesexp.report.page", script="report")
BUNDLE = code_of("vinesexp.report.bundle", script="bundle")
DESCRIPTION = [CAMPAIGN_FOLDER / "campaign.yaml", CAMPAIGN.sheet]


rule figures:
    input:
        PLANNER.again("figures", FIGURES, PATHS.figures),
        shown_in,
    output:
        manifest=PATHS.figures("{family}"),
    log:
        PATHS.log("figures", "{family}"),
    params:
        about=PLANNER.about("figures", FIGURES),
    message:
        "figures    of the {wildcards.family}"
    script:
        "../scripts/figures.py"


rule report:
    input:
        PLANNER.again("report", REPORT, PATHS.report),
        tables=[
            PATHS.identified,
            PATHS.level_values,
            PATHS.regimes,
            PATHS.base,
            PATHS.bands,
            PATHS.transitions,
            PATHS.decay_times,
            PATHS.clearances,
            PATHS.budget,
            PATHS.replay,
            PATHS.checks,
        ],
        truth=[PATHS.truth] if SCENE else [],
        records=each_record(PATHS.record),
        conditioned=each_record(PATHS.conditioned),
        impacts=each_record(PATHS.impacts),
        figures=[PATHS.figures(family) for family in ("results", "records")],
    output:
        page=report(PATHS.report, category="Report"),
    log:
        PATHS.log("report"),
    params:
        about=PLANNER.about("report", REPORT, reads=DESCRIPTION),
    message:
        "report     of all results"
    script:
        "../scripts/report.py"


# On request, `snakemake bundle`: all that others may want, in one file.
rule bundle:
    input:
        PLANNER.again("bundle", BUNDLE, PATHS.bundle),
        rules.report.output,
        rules.pages.output,
        ([PATHS.truth] if SCENE else []),
        each_record(PATHS.conditioned),
    output:
        PATHS.bundle,
    log:
        PATHS.log("bundle"),
    params:
        about=PLANNER.about("bundle", BUNDLE),
    message:
        "bundle     of all results"
    script:
        "../scripts/bundle.py"
