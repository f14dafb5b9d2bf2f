rule report:
    input:
        rules.ingest.output,
        rules.identify.output,
        rules.predict.output,
        rules.loop.output,
    output:
        "reports/{batch}/report.pdf",
        "reports/{batch}/provenance.json",
    log:
        "logs/report/{batch}.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=plan.memory("report"),
        runtime=plan.minutes("report"),
    params:
        processed=subpath(input[0], parent=True),
        reports=subpath(output[0], parent=True),
        settings=plan.settings("report"),
        code=plan.code("report"),
    message:
        "{wildcards.batch}: writing the report"
    shell:
        "metro report --processed {params.processed:q} --reports {params.reports:q} --settings {params.settings:q} --code {params.code:q} > {log:q} 2>&1"
