rule verdict:
    input:
        rules.loop.output.findings,
        rules.loop.output.identified,
        rules.loop.output.lobes,
        rules.ingest.output.batch,
        rules.ingest.output.tables,
        rules.identify.output.tables,
    output:
        loop="data/processed/{batch}/loop.json",
        made="data/processed/{batch}/verdict.made.json",
        verdict=report(
            "reports/{batch}/verdict.json",
            caption="../report/verdict.rst",
            category="Batches",
            subcategory="{batch}",
            labels={"content": "verdicts", "format": "JSON"},
        ),
    log:
        "logs/verdict/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("verdict"),
        runtime=plan.minutes("verdict"),
    params:
        processed=subpath(input[0], parent=True),
        reports=subpath(output[-1], parent=True),
        settings=plan.settings("verdict"),
        code=plan.code("verdict"),
        files=lambda wildcards, input, output: files_of(input, output),
    message:
        "{wildcards.batch}: putting the findings into words"
    shell:
        "metro verdict --processed {params.processed:q} --reports {params.reports:q} --settings {params.settings:q} --code {params.code:q} --files {params.files:q} > {log:q} 2>&1"
