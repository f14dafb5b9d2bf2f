"""Results that are kept: where all that a stage takes is as it was, they are put back instead of made again.

Snakemake decides what to run before it runs anything. After an edit of a reader it deletes the results of
every later stage and runs these stages, even where the tables came out the same. A stage therefore keeps its
results, as hard links that take no room, under the hash of all that it takes: files, code, settings and
versions of packages. A stage that finds that hash again puts its results back in a moment.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from metro.batch.provenance import packages, sha256
from metro.units import JSON

FRESH = "METRO_FRESH"  # environment variable: where it is set, every stage makes its results anew
FOLDER = ".kept"
CONTENT = "content.json"


@dataclass(frozen=True)
class Job:
    """A stage's job on a batch.

    Attributes
    ----------
    stage : its name.
    takes, gives : the files that it reads, and those that it writes.
    made_with : code and settings of the stage.
    home : the folder of the batch's tables, which holds what is kept.
    """

    stage: str
    takes: tuple[Path, ...]
    gives: tuple[Path, ...]
    made_with: JSON
    home: Path

    @classmethod
    def planned(cls, stage: str, files: str, settings: JSON, code: str, home: Path) -> Job:
        """Return the job that snakemake planned; ``files`` as the command line has them."""
        content: dict[str, list[str]] = json.loads(files)
        takes, gives = (tuple(map(Path, content[key])) for key in ("takes", "gives"))
        return cls(stage, takes, gives, {"code": code, "settings": settings}, home)

    @property
    def kept(self) -> Path:
        """The folder that holds the results of the stage's last run."""
        return self.home / FOLDER / self.stage

    def digest(self) -> str:
        """Return the hash of all that the job takes."""
        files = {str(path): sha256(path) for path in self.takes}
        content = {"files": files, "packages": packages(), **self.made_with}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def put_back(job: Job, digest: str) -> bool:
    """Put the results of the last run back where it took the same; return whether they are all there.

    A kept file that is not what was written (a person edited a result in place, and the kept one is a hard
    link to it) counts as none at all.
    """
    file = job.kept / CONTENT
    content = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    if content.get("digest") != digest or set(content["files"]) != set(map(str, job.gives)):
        return False
    kept = {path: job.kept / str(number) for number, path in enumerate(job.gives)}
    if not all(at.is_file() and sha256(at) == content["files"][str(path)] for path, at in kept.items()):
        return False
    for path, at in kept.items():
        path.unlink(missing_ok=True)
        os.link(at, path)
        os.utime(path)  # Snakemake compares times: what is put back is newer than what it was made from
    return True


def keep(job: Job, digest: str) -> None:
    """Keep the results of a job that has ended well; none where the file system has no hard links."""
    shutil.rmtree(job.kept, ignore_errors=True)
    job.kept.parent.mkdir(exist_ok=True)
    # The name is one that the next call of snakemake clears away if this one is killed.
    staging = Path(tempfile.mkdtemp(prefix=f".{job.stage}.", dir=job.kept.parent))
    try:
        for number, path in enumerate(job.gives):
            os.link(path, staging / str(number))
        files: Mapping[str, str] = {str(path): sha256(path) for path in job.gives}
        text = json.dumps({"digest": digest, "files": files}, sort_keys=True)
        (staging / CONTENT).write_text(text, encoding="utf-8")
        staging.replace(job.kept)
    except OSError:
        shutil.rmtree(staging, ignore_errors=True)
