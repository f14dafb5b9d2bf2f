rule loop:
    input:
        rules.ingest.output.tables,
        rules.ingest.output.batch,
        rules.identify.output.tables,
        rules.identify.output.problems,
        rules.identify.output.identified,
        rules.predict.output.prediction,
    output:
        comparison="data/processed/{batch}/comparison.parquet",
        lobes="data/processed/{batch}/lobes_final.parquet",
        findings="data/processed/{batch}/findings.json",
        made="data/processed/{batch}/loop.made.json",
        identified=report(
            "reports/{batch}/identified.json",
            caption="../report/identified.rst",
            category="Batches",
            subcategory="{batch}",
            labels={"content": "identified quantities", "format": "JSON"},
        ),
    log:
        "logs/loop/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("loop"),
        runtime=plan.minutes("loop"),
    params:
        processed=subpath(input[0], parent=True),
        reports=subpath(output[-1], parent=True),
        settings=plan.settings("loop"),
        code=plan.code("loop"),
        files=lambda wildcards, input, output: files_of(input, output),
    message:
        "{wildcards.batch}: tracing what the prediction leaves over"
    shell:
        "metro loop --processed {params.processed:q} --reports {params.reports:q} --settings {params.settings:q} --code {params.code:q} --files {params.files:q} > {log:q} 2>&1"
