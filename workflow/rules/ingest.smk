rule ingest:
    input:
        local(plan.raw_files),
    output:
        tables=expand(
            "data/processed/{{batch}}/{table}.parquet",
            table=[
                "force",
                "robot",
                "joint",
                "path",
                "scan",
                "profile",
                "slopes",
                "poses",
                "targets",
                "hit",
                "frf",
                "loads",
                "mass",
                "touches",
                "payload",
                "pickups",
                "stations",
                "published",
                "qc",
                "runs",
            ],
        ),
        batch="data/processed/{batch}/batch.json",
        made="data/processed/{batch}/ingest.made.json",
    log:
        "logs/ingest/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("ingest"),
        runtime=plan.minutes("ingest"),
    params:
        folder=plan.folder,
        cells=plan.cells,
        out=subpath(output[0], parent=True),
        settings=plan.settings("ingest"),
        code=plan.code("ingest"),
    message:
        "{wildcards.batch}: checking and reading the raw files"
    shell:
        "metro ingest {params.folder:q} --cells {params.cells:q} --out {params.out:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
