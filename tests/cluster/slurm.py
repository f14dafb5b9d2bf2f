"""A Slurm of two nodes on this machine, in a folder of its own: ``python tests/cluster/slurm.py FOLDER``.

Nothing of the system's is used or changed: munge has its own key and socket, every port is a free one. Each
node is a ``slurmd`` in a process namespace of its own, so that killing it takes all that runs on it along, as
the loss of a machine does. Debian: ``apt-get install slurm-wlm munge``; needs root.
"""

import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path
from shutil import which

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "unshare")
NODES = ("n1", "n2")
SYSTEM = f"/usr/sbin{os.pathsep}/sbin"
CONFIGURATION = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SwitchType=switch/none
ReturnToService=2
SlurmdTimeout=10
MinJobAge=86400
KillWait=2
SchedulerParameters=batch_sched_delay=0,sched_interval=1
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
DefMemPerCPU=500
JobAcctGatherType=jobacct_gather/linux
JobAcctGatherFrequency=1
JobAcctGatherParams=OverMemoryKill
SlurmdParameters=config_overrides
{nodes}
PartitionName=all Nodes={names} Default=YES MaxTime=INFINITE State=UP
"""
NODE = "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs=1 RealMemory=9000"


def missing():
    """Say why a Slurm cannot be started here, or ""."""
    absent = [name for name in PROGRAMS if not which(name, path=_search())]
    if absent:
        return f"Slurm is not installed: {', '.join(absent)} missing (apt-get install slurm-wlm munge)"
    return "" if os.geteuid() == 0 else "starting a Slurm needs root"


class Slurm:
    """A Slurm that runs. ``environment`` is what its commands, and snakemake, need beside their own."""

    def __init__(self, folder, stack):
        self.folder, self.stack, self.nodes = folder, stack, {}
        search = f"{folder / 'bin'}{os.pathsep}{_search()}"
        self.environment = {"PATH": search, "SLURM_CONF": str(folder / "slurm.conf")}

    def ask(self, *command):
        """Return what a command of Slurm prints."""
        environment = {**os.environ, **self.environment}
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=True, timeout=30
        )
        return done.stdout

    def jobs(self, node=""):
        """Return the ids of the jobs that run, on one node if it is named."""
        where = ["--nodelist", node] if node else []
        return self.ask("squeue", "--noheader", "--states", "RUNNING", "--format", "%i", *where).split()

    def states(self):
        """Return the state of each node by name."""
        lines = self.ask("sinfo", "--noheader", "--Node", "--format", "%N %T").splitlines()
        return dict(line.split() for line in lines)

    def start(self, name, *command, end=subprocess.Popen.terminate):
        """Start one of its programs, to be ended with it; what it says goes to a file of that name."""
        with (self.folder / f"{name}.log").open("ab") as log:
            environment = {**os.environ, **self.environment}
            program = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
        self.stack.callback(_ended, program, end)
        return program

    def start_node(self, name):
        """Start a node, as the first process of a namespace that ends with it."""
        separate = ("unshare", "--pid", "--fork", "--mount-proc", "--kill-child")
        program = ("slurmd", "-D", "-N", name)
        self.nodes[name] = self.start(name, *separate, *program, end=subprocess.Popen.kill)

    def lose_node(self, name):
        """Kill a node and all that runs on it."""
        _ended(self.nodes[name], subprocess.Popen.kill)

    def wait(self, truth, what, timeout=60):
        """Wait until something is so."""
        end = time.monotonic() + timeout
        while not truth():
            assert time.monotonic() < end, f"{what}: not in {timeout} s, see {self.folder}/*.log"
            time.sleep(0.2)

    def answers(self):
        """Tell whether all nodes are up."""
        try:
            return set(self.states().items()) == {(name, "idle") for name in NODES}
        except subprocess.SubprocessError:
            return False


@contextmanager
def slurm(folder):
    """Start a Slurm in a folder; it is stopped at the end."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("bin", "state", *(f"spool-{node}" for node in NODES)):
        (folder / name).mkdir(exist_ok=True)
    key = folder / "munge.key"
    key.touch(mode=0o600)
    key.write_bytes(secrets.token_bytes(128))
    host = socket.gethostname().partition(".")[0]
    controller, *ports = _free_ports(1 + len(NODES))
    nodes = [NODE.format(name=name, host=host, port=port) for name, port in zip(NODES, ports, strict=True)]
    values = {"folder": folder, "host": host, "controller": controller, "names": ",".join(NODES)}
    (folder / "slurm.conf").write_text(CONFIGURATION.format(**values, nodes="\n".join(nodes)))
    # Snakemake takes SLURM_CONF from a job's environment before it calls srun.
    (folder / "bin/srun").write_text(
        f'#!/bin/sh\nSLURM_CONF="{folder}/slurm.conf" exec {which("srun", path=_search())} "$@"\n'
    )
    (folder / "bin/srun").chmod(0o755)
    with ExitStack() as stack:
        made = Slurm(folder, stack)
        own = ("socket", "pid-file", "log-file", "seed-file")
        places = [f"--{name}={folder}/munge.{name.partition('-')[0]}" for name in own]
        made.start("munged", "munged", "--foreground", "--force", f"--key-file={key}", *places)
        made.wait((folder / "munge.socket").exists, "munged")
        made.start("slurmctld", "slurmctld", "-D", "-c")
        for name in NODES:
            made.start_node(name)
        made.wait(made.answers, "the nodes")
        yield made


def _search():
    return f"{os.environ['PATH']}{os.pathsep}{SYSTEM}"


def _free_ports(count):
    with ExitStack() as stack:
        sockets = [stack.enter_context(closing(socket.socket())) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


def _ended(program, end):
    end(program)
    program.wait(timeout=30)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with slurm(Path(sys.argv[1]).resolve()) as running:
        print(f"export SLURM_CONF={running.folder}/slurm.conf   # to end it: kill {os.getpid()}", flush=True)
        with suppress(KeyboardInterrupt):
            signal.pause()
