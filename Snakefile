# `snakemake` in this folder: from a campaign folder to results/<campaign>/report.html.
# The workflow itself is workflow/Snakefile.
#   snakemake                                   the default campaign, data/twin
#   snakemake --config campaign=PATH            any other
#   snakemake --config results=DIR              results elsewhere
#   snakemake -n                                what would run, and why; -n -p: job by job


include: "workflow/Snakefile"


# Snakemake runs by default what the Snakefile itself asks for, not what an included one does.
rule results:
    default_target: True
    input:
        rules.all.input,
    message:
        f"done: {PATHS.report}"
