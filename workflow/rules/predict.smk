rule predict:
    input:
        rules.ingest.output,
        rules.identify.output,
    output:
        "data/processed/{batch}/prediction.parquet",
    log:
        "logs/predict/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("predict"),
        runtime=plan.minutes("predict"),
    params:
        processed=subpath(input[0], parent=True),
        settings=plan.settings("predict"),
        code=plan.code("predict"),
    message:
        "{wildcards.batch}: predicting the held-out runs"
    shell:
        "metro predict --processed {params.processed:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
