"""A whole cell for one test: free ports, a DDS domain of its own, a folder of its own."""

import contextlib
import fcntl
import pathlib
import sys
import tempfile
import types

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "clients" / "python"), str(SOURCE / "deploy" / "main_job")]

import cell_processes  # noqa: E402
import lambdajet_client  # noqa: E402

HOUSES = cell_processes.SEVEN + (cell_processes.JUDGE,)


@contextlib.contextmanager
def private_domain():
    """A DDS domain nobody else on this host uses as long as the lock is held; the same locks as tests/support takes."""
    for domain in range(1, 201):
        lock = open(f"/tmp/lambdajet-test-domain-{domain}.lock", "a", encoding="ascii")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            lock.close()
            continue
        with lock:
            yield domain
        return
    raise RuntimeError("all 200 DDS domains for tests are taken")


@contextlib.contextmanager
def cell_under_test(build, plant=SOURCE / "deploy" / "plants" / "shipped.yaml", seed=1, flags=(),
                    machine=SOURCE / "deploy" / "config" / "machine.yaml"):
    """Yields (processes, cell), serving; stops them at the end and keeps the logs' last words for a failure."""
    with private_domain() as domain, tempfile.TemporaryDirectory(prefix="lambdajet-cell-") as folder:
        options = types.SimpleNamespace(machine=machine, plant=plant, seed=seed)
        processes = cell_processes.LocalProcesses(
            SOURCE,
            pathlib.Path(build),
            pathlib.Path(folder),
            options,
            flags=[f"--bus.domain={domain}", "--metrics.address=127.0.0.1:0", *flags],
            ports=cell_processes.free_ports(domain),
        )
        with contextlib.ExitStack() as at_the_end:
            at_the_end.callback(processes.stop)
            processes.start()
            cell = wait_serving(processes, HOUSES)
            at_the_end.callback(cell.close)  # first: a server waits some seconds for clients that are still connected
            yield processes, cell


def wait_serving(processes, names, deadline_s=30):
    return cell_processes.wait_until_serving(processes, lambdajet_client.Cell, names, deadline_s, lambda done, of: None)
