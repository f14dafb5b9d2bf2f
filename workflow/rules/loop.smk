rule loop:
    input:
        rules.ingest.output,
        rules.identify.output,
        rules.predict.output,
    output:
        "data/processed/{batch}/comparison.parquet",
        "data/processed/{batch}/lobes_final.parquet",
        "data/processed/{batch}/loop.json",
        "reports/{batch}/identified.json",
        "reports/{batch}/verdict.json",
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
    message:
        "{wildcards.batch}: tracing what the prediction leaves over"
    shell:
        "metro loop --processed {params.processed:q} --reports {params.reports:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
