"""What can be asked for: the report of every batch, and the summary of all of them."""

import os
import sys

from snakemake.logging import logger
from snakemake.utils import min_version

from metro.batch.alike import alike_as_one
from metro.batch.at_work import only_one_at_work, remove_leftovers
from metro.batch.findings import ContractError
from metro.batch.kept import FRESH
from metro.observables.catalogue import drawn_tables, observed_tables
from metro.progress import show_progress
from metro.workflow import COMPLETE, Plan, files_of

min_version("9.0")


report: "workflow/report/workflow.rst"


show_progress(logger, workflow.output_settings, shorten=alike_as_one)
try:
    # The folder of this file. `workflow.basedir` is that of the file which snakemake was called with.
    plan = Plan.read(Path(str(workflow.current_basedir)), overrides=config)
except ContractError as error:
    # As an error of snakemake it would be followed by where in the program it was raised.
    sys.exit(str(error))
shell.prefix(plan.shell_prefix)


wildcard_constraints:
    batch=plan.any_batch,


onstart:
    only_one_at_work(Path.cwd())
    remove_leftovers(Path("data/processed"), Path("reports"))
    # Who forces a rule wants its results made anew, not put back.
    if workflow.dag_settings.forceall or workflow.dag_settings.forcerun:
        os.environ[FRESH] = "yes"


onerror:
    COMPLETE.unlink(missing_ok=True)
    if plan.partial_summary():
        shell("mkdir -p reports && {command}", command=plan.partial_summary())


rule all:
    default_target: True
    input:
        expand("reports/{batch}/report.pdf", batch=plan.batches),
        expand("reports/{batch}/identified.json", batch=plan.batches),
        expand("reports/{batch}/verdict.json", batch=plan.batches),
        "reports/summary.pdf",
        COMPLETE,  # gone where a failed call wrote a summary of what is there: it is written anew then
    message:
        "all reports are up to date"


include: "workflow/rules/ingest.smk"
include: "workflow/rules/identify.smk"
include: "workflow/rules/predict.smk"
include: "workflow/rules/loop.smk"
include: "workflow/rules/verdict.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/campaign.smk"
