rule identify:
    input:
        rules.ingest.output.tables,
        rules.ingest.output.batch,
    output:
        tables=expand(
            "data/processed/{{batch}}/{table}.parquet", table=observed_tables()
        ),
        problems="data/processed/{batch}/problems.pickle",
        identified="data/processed/{batch}/identified.json",
        made="data/processed/{batch}/identify.made.json",
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
        files=lambda wildcards, input, output: files_of(input, output),
    message:
        "{wildcards.batch}: identifying the models"
    shell:
        "metro identify --processed {params.processed:q} --settings {params.settings:q} --code {params.code:q} --files {params.files:q} > {log:q} 2>&1"
