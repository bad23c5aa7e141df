# A large map, in parts that run side by side on this machine or on a cluster:
#   snakemake -s workflow/map.smk --configfile config/map.yaml
#   snakemake -s workflow/map.smk --configfile config/map.yaml --workflow-profile profiles/slurm
# Every part is a share of the rows, and completes what a stopped run has left of it.
import hashlib
import json
import shlex
import sys
from pathlib import Path

from vinesexp.codedigest import code_digest

WANTED = {"out", "parts", "picture", "options"}
if not {"out", "options"} <= set(config) <= WANTED:
    sys.exit(
        f"vinesexp map: found the settings {', '.join(sorted(config)) or 'none'}, expected "
        "out and options, and if wanted parts and picture: see config/map.yaml"
    )

OUT, PARTS = Path(config["out"]), int(config.get("parts", 8))
PICTURE = Path(config.get("picture", OUT.with_suffix(".svg")))
OPTIONS = " ".join(
    shlex.quote(word)
    for key, value in config["options"].items()
    for word in (f"--{key}", str(value))
)
COMMAND = f"{shlex.quote(sys.executable)} -m vinesexp.cli map {OPTIONS}"
# Other options or other code have parts of their own, so that no map is joined of two kinds.
KIND = hashlib.sha256(
    json.dumps([OPTIONS, code_digest("vinesexp.maps.response_map")]).encode()
).hexdigest()[:12]
FOLDER = OUT.with_name(f"{OUT.stem}.parts") / KIND


localrules:
    joined_map,


rule joined_map:
    default_target: True
    input:
        expand(str(FOLDER / "part-{part}.nc"), part=range(1, PARTS + 1)),
    output:
        map=str(OUT),
        picture=str(PICTURE),
    log:
        str(FOLDER / "joined.log"),
    message:
        f"map        joined: {OUT}"
    shell:
        COMMAND + " --out {output.map:q} --plot {output.picture:q} --join {input:q} > {log:q} 2>&1"


rule part_of_a_map:
    output:
        str(FOLDER / "part-{part}.nc"),
    log:
        str(FOLDER / "part-{part}.log"),
    threads: workflow.cores or 1
    resources:
        runtime=240,
    message:
        f"map        part {{wildcards.part}} of {PARTS}"
    shell:
        COMMAND
        + f" --rows {{wildcards.part}}/{PARTS} --out {{output:q}}.unfinished > {{log:q}} 2>&1"
        " && mv {output:q}.unfinished {output:q}"
