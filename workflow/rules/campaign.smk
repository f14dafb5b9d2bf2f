rule campaign:
    input:
        identified=expand("reports/{batch}/identified.json", batch=plan.batches),
        verdicts=expand("reports/{batch}/verdict.json", batch=plan.batches),
        manifests=expand("data/processed/{batch}/batch.json", batch=plan.batches),
        runs=expand("data/processed/{batch}/runs.parquet", batch=plan.batches),
        tables=expand(
            "data/processed/{batch}/{table}.parquet",
            batch=plan.batches,
            table=["comparison", "lobes_final", *drawn_tables()],
        ),
        loops=expand("data/processed/{batch}/loop.json", batch=plan.batches),
    output:
        "reports/summary.parquet",
        "reports/memory.json",
        report(
            "reports/summary.pdf",
            caption="../report/summary.rst",
            category="All batches",
            labels={"content": "summary", "format": "PDF"},
        ),
        report(
            "reports/summary.html",
            caption="../report/summary.rst",
            category="All batches",
            labels={"content": "summary", "format": "HTML"},
        ),
        touch("logs/campaign.complete"),
    log:
        "logs/campaign.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("campaign"),
        runtime=plan.minutes("campaign"),
    params:
        batches=lambda wildcards, input: [
            str(Path(file).parent) for file in input.identified
        ],
        processed=subpath(input[-1], ancestor=2),
        out=subpath(output[0], parent=True),
        settings=plan.settings("campaign"),
        code=plan.code("campaign"),
    message:
        "writing the summary of all batches"
    shell:
        "metro campaign {params.batches:q} --processed {params.processed:q} --out {params.out:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
