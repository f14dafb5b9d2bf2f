rule campaign:
    input:
        expand("reports/{batch}/identified.json", batch=plan.batches),
        expand("reports/{batch}/verdict.json", batch=plan.batches),
    output:
        "reports/summary.parquet",
        "reports/summary.pdf",
    log:
        "logs/campaign.log",
    conda:
        "../envs/metro.yaml"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        batches=expand("reports/{batch}", batch=plan.batches),
        out=subpath(output[0], parent=True),
        settings=plan.settings("campaign"),
        code=plan.code("campaign"),
    message:
        "writing the summary of all batches"
    shell:
        "metro campaign {params.batches} --out {params.out} --settings {params.settings:q} --code {params.code} > {log} 2>&1"
