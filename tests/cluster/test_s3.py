"""Results in an S3 bucket, of a server on this machine: a local run's bytes, there and back."""

import hashlib
import shutil

import pytest
from checkout import Checkout

pytest.importorskip("snakemake_storage_plugin_s3", reason="metro-machining[s3] is not installed")
boto3 = pytest.importorskip("boto3", reason="metro-machining[s3] is not installed")
server = pytest.importorskip("moto.server", reason="moto[server] is not installed")
pytestmark = [pytest.mark.workflow, pytest.mark.xdist_group("workflow")]
KEYS = ("x", "x")


@pytest.fixture(scope="module")
def bucket():
    """Start a server with an empty bucket; return its client and address."""
    running = server.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    running.start()
    host, port = running.get_host_and_port()
    address = f"http://{host}:{port}"
    own = dict(zip(("aws_access_key_id", "aws_secret_access_key"), KEYS, strict=True))
    client = boto3.client("s3", endpoint_url=address, region_name="us-east-1", **own)
    client.create_bucket(Bucket="metro")
    yield client, address
    running.stop()


def call(folder, unrun, address):
    """Call snakemake in a checkout of its own, which has the raw files and no results."""
    shutil.copytree(unrun.folder, folder)
    checkout = Checkout(folder)
    checkout.environment = {
        **checkout.environment,
        **dict(
            zip(("SNAKEMAKE_STORAGE_S3_ACCESS_KEY", "SNAKEMAKE_STORAGE_S3_SECRET_KEY"), KEYS, strict=True)
        ),
    }
    where = ("--storage-s3-endpoint-url", address)
    bucket = ("--default-storage-provider", "s3", "--default-storage-prefix", "s3://metro")
    return checkout.call(*where, *bucket)


def stored(client):
    """Return SHA-256 by key of what is in the bucket, logs left out."""
    pages = client.get_paginator("list_objects_v2").paginate(Bucket="metro")
    keys = [entry["Key"] for page in pages for entry in page.get("Contents", [])]
    return {
        key: hashlib.sha256(client.get_object(Bucket="metro", Key=key)["Body"].read()).hexdigest()
        for key in keys
        if not key.startswith("logs/")
    }


def test_there_and_back(bucket, unrun, reference, tmp_path):
    client, address = bucket
    call(tmp_path / "first", unrun, address)
    assert stored(client) == reference
    assert not (tmp_path / "first/reports").exists()
    client.delete_object(Bucket="metro", Key="reports/alpha/report.pdf")
    printed = call(tmp_path / "second", unrun, address)
    assert "alpha: writing the report" in printed
    assert "checking and reading" not in printed
    assert stored(client) == reference
