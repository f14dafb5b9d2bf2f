rule identify:
    input:
        rules.ingest.output,
    output:
        expand("data/processed/{{batch}}/{table}.parquet", table=OBSERVED),
        "data/processed/{batch}/identified.json",
    log:
        "logs/identify/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("identify"),
        runtime=plan.minutes("identify"),
    params:
        processed=subpath(input[0], parent=True),
        settings=plan.settings("identify"),
        code=plan.code("identify"),
    message:
        "{wildcards.batch}: identifying the models"
    shell:
        "metro identify --processed {params.processed:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
