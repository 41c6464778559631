"""Starts the processes of one cell on this host, waits until they serve, stops them in order."""

import contextlib
import json
import pathlib
import signal
import socket
import subprocess
import time

SEVEN = ("kinematics", "calibration", "trajectory", "accuracy", "cell", "drive", "main_motion")
JUDGE = "inspection"
PORTS_BEGIN, PORTS_PER_DOMAIN = 20000, 16  # the same in tests/support/cell_processes.hpp
# Calibration first: everyone else waits for the machine description that it publishes.
START_ORDER = ("calibration", "drive", "main_motion", "kinematics", "trajectory", "accuracy", "cell", JUDGE)
STOP_ORDER = ("cell", "trajectory", "accuracy", "kinematics", "drive", "main_motion", "calibration", JUDGE)


def free_ports(domain):
    """A free TCP port for each process, from a block that belongs to the DDS domain as long as somebody holds that. Below
    the ports the kernel gives to whoever asks for any: one of those may be given away again before the process takes it."""
    block = iter(range(PORTS_BEGIN + PORTS_PER_DOMAIN * domain, PORTS_BEGIN + PORTS_PER_DOMAIN * (domain + 1)))
    ports = {}
    for name in START_ORDER:
        ports[name] = next((port for port in block if is_free(port)), None)
        if ports[name] is None:
            raise StartFailed(f"fewer than {len(START_ORDER)} free ports in the block of domain {domain}")
    return ports


def is_free(port):
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with contextlib.suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return True
    return False


class StartFailed(Exception):
    """A process did not come up; the text says which, why, and where its log is."""


class LocalProcesses:
    """Every process as a child of this one. Logs and announce files lie in the run's folder. flags: more flags for every
    process; ports: name -> gRPC port, for those that shall not listen where their file says."""

    def __init__(self, source, build, run_folder, options, flags=(), ports=None):
        self.flags = list(flags)
        self.ports = ports or {}
        self.source = source
        self.bin = build / "bin"
        self.folder = run_folder
        self.options = options
        self.children = {}

    def arguments(self, name):
        flags = [
            f"--config={self.source / 'deploy' / 'config' / (name + '.yaml')}",
            f"--announce_file={self.folder / (name + '.announce.json')}",
        ]
        if name == "calibration":
            flags += [f"--machine={self.options.machine}", f"--store={self.folder / 'calibration.sqlite'}"]
        if name == "cell":
            flags += [f"--store={self.folder / 'cell.sqlite'}"]
        if name in ("drive", "main_motion"):
            flags += [f"--plant={self.options.plant}", f"--seed={self.options.seed}"]
        if name in self.ports:
            flags += [f"--rpc.address=127.0.0.1:{self.ports[name]}"]
        if name == "cell" and self.ports:
            flags += [f"--trajectory.address=127.0.0.1:{self.ports['trajectory']}"]
        return flags + self.flags

    def start(self):
        """Starts all; returns the instant, time.monotonic()."""
        self.folder.mkdir(parents=True, exist_ok=True)
        started = time.monotonic()
        for name in START_ORDER:
            self.start_one(name)
        return started

    def start_one(self, name):
        (self.folder / f"{name}.announce.json").unlink(missing_ok=True)
        with open(self.folder / f"{name}.log", "ab") as log:
            # A session of its own: Ctrl-C reaches only this program, which stops the cell in order.
            self.children[name] = subprocess.Popen(
                [str(self.bin / name)] + self.arguments(name),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def kill(self, name):
        """As a crash would: no orderly end. Returns the instant in the modules' common time, ns."""
        child = self.children.pop(name)
        instant = time.time_ns()
        child.kill()
        child.wait()
        return instant

    def announced(self, name):
        """The process' announce file, or None while it has not written it."""
        try:
            return json.loads((self.folder / f"{name}.announce.json").read_text())
        except (OSError, ValueError):
            return None

    def addresses(self):
        found = {}
        for name in START_ORDER:
            announced = self.announced(name)
            if announced is not None:
                found[name] = f"127.0.0.1:{announced['rpc_port']}"
        return found

    def check_alive(self):
        for name, child in self.children.items():
            code = child.poll()
            if code is not None:
                raise StartFailed(f"{name} ended with exit code {code}: {self.last_words(name)}")

    def last_words(self, name):
        path = self.folder / f"{name}.log"
        lines = path.read_text(errors="replace").strip().splitlines() if path.exists() else []
        return f"{lines[-1] if lines else 'it said nothing'} (log: {path})"

    def resident_mib(self):
        """Resident memory of each process, MiB."""
        result = {}
        for name, child in self.children.items():
            try:
                status = pathlib.Path(f"/proc/{child.pid}/status").read_text()
            except OSError:
                continue
            for line in status.splitlines():
                if line.startswith("VmRSS:"):
                    result[name] = int(line.split()[1]) / 1024.0
        return result

    def stop(self):
        for name in STOP_ORDER:
            child = self.children.get(name)
            if child is None or child.poll() is not None:
                continue
            child.send_signal(signal.SIGTERM)
            try:
                child.wait(timeout=5)
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
        self.children.clear()


def wait_until_serving(processes, make_cell, names, deadline_s, tell):
    """Waits until every process serves; returns the connected cell. make_cell: addresses -> Cell."""
    deadline = time.monotonic() + deadline_s
    waiting = list(names)
    cell = None
    while waiting:
        processes.check_alive()
        if time.monotonic() > deadline:
            words = "; ".join(f"{name}: {processes.last_words(name)}" for name in waiting)
            raise StartFailed(f"not serving after {deadline_s:.0f} s: {words}")
        addresses = processes.addresses()
        if all(name in addresses for name in names):
            cell = cell or make_cell(addresses)
            waiting = [name for name in waiting if not cell.serving(name)]
        if waiting:
            tell(len(names) - len(waiting), len(names))
            time.sleep(0.02)
    return cell
