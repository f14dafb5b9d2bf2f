"""A project folder in which a bundled batch has been through the pipeline, up to its verdict."""

import json
import shutil
from pathlib import Path

from metro.batch.config import load_config
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.loop import loop
from metro.stages.predict import predict
from metro.stages.verdict import verdict

ROOT = Path(__file__).resolve().parents[2]


def closed_project(root, raw, closing=True):
    """Run the stages on a folder of raw files, in a project ``root``; without ``closing`` the fits alone."""
    settings = load_config(ROOT / "config/config.yaml")
    processed, reports = (root / part / raw.name for part in ("data/processed", "reports"))
    for folder in (processed, reports, root / "data/raw"):
        folder.mkdir(parents=True, exist_ok=True)
    if not raw.is_relative_to(root):
        (root / "data/raw" / raw.name).symlink_to(raw)
    budget = {"model_form_budget": settings["loop"]["model_form_budget"]}
    ingest(raw, ROOT / "config/cells", processed, {"holdout": settings["holdout"]}, "code")
    identify(processed, budget, "code")
    if not closing:
        return root
    predict(processed, {}, "code")
    loop(processed, reports, settings["loop"], "code")
    verdict(processed, reports, {}, "code")
    return root


def without_effects(root, name):
    """Write the results of a batch in which the search would find nothing, without the time that it takes."""
    reports, processed = root / "reports" / name, root / "data/processed" / name
    reports.mkdir(parents=True, exist_ok=True)
    shutil.copy(processed / "identified.json", reports)
    (reports / "verdict.json").write_text(json.dumps({"observables": {"force": {"effects": []}}}))
