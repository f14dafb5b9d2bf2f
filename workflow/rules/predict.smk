rule predict:
    input:
        rules.identify.output.problems,
    output:
        prediction="data/processed/{batch}/prediction.parquet",
        made="data/processed/{batch}/predict.made.json",
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
        files=lambda wildcards, input, output: files_of(input, output),
    message:
        "{wildcards.batch}: predicting the held-out runs"
    shell:
        "metro predict --processed {params.processed:q} --settings {params.settings:q} --code {params.code:q} --files {params.files:q} > {log:q} 2>&1"
