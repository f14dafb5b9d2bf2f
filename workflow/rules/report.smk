rule report:
    input:
        rules.ingest.output.tables,
        rules.ingest.output.batch,
        rules.identify.output.tables,
        rules.identify.output.problems,
        rules.loop.output.comparison,
        rules.loop.output.lobes,
        rules.loop.output.identified,
        rules.verdict.output.loop,
        rules.verdict.output.verdict,
    output:
        report(
            "reports/{batch}/report.pdf",
            caption="../report/report.rst",
            category="Batches",
            subcategory="{batch}",
            labels={"content": "report", "format": "PDF"},
        ),
        report(
            "reports/{batch}/report.html",
            caption="../report/report.rst",
            category="Batches",
            subcategory="{batch}",
            labels={"content": "report", "format": "HTML"},
        ),
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
        files=lambda wildcards, input, output: files_of(input, output),
    message:
        "{wildcards.batch}: writing the report"
    shell:
        "metro report --processed {params.processed:q} --reports {params.reports:q} --settings {params.settings:q} --code {params.code:q} --files {params.files:q} > {log:q} 2>&1"
