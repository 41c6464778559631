"""The cell as containers: builds the image once, brings deploy/compose.yaml up, and takes it down again."""

import json
import os
import pathlib
import re
import secrets
import shutil
import signal
import subprocess
import time

from cell_processes import SEVEN, START_ORDER, STOP_ORDER, StartFailed

BASE = os.environ.get("LAMBDAJET_CONTAINER_BASE", "localhost/debian:bookworm-slim")
IMAGE = os.environ.get("LAMBDAJET_CONTAINER_IMAGE", "localhost/lambdajet")
PORTS = {
    "kinematics": 50051,
    "calibration": 50052,
    "trajectory": 50053,
    "accuracy": 50054,
    "cell": 50055,
    "drive": 50056,
    "main_motion": 50057,
    "inspection": 50058,
}
USER = 65532
MODULES = ("drive", "main_motion")
# Of each second; room for two cells on one host.
REAL_TIME_US_OF_ALL = 850_000
REAL_TIME_US_OF_A_MODULE = 200_000


def tell_image_step(line):
    """What takes long while an image is made: the commands that run in it, and how far the build is."""
    if re.match(r"(\[\d+/\d+\] )?STEP \S+ RUN ", line) or line.startswith(("build: ", "install: ")):
        print(f"    {line:.110}", flush=True)


class Containers:
    """The same face as cell_processes.LocalProcesses."""

    def __init__(self, source, run_folder, options):
        self.source = source
        self.folder = run_folder
        self.options = options
        # Of its own, so that two demos, or what else runs on this host, never touch each other.
        self.project = f"lambdajet-{os.getpid()}"
        self.environment = dict(
            os.environ,
            CONTAINERS_CONF=str(source / "deploy" / "containers.conf"),
            LAMBDAJET_IMAGE=IMAGE,
            LAMBDAJET_RUN=str(run_folder),
            LAMBDAJET_MACHINE=str(options.machine),
            LAMBDAJET_PLANT=str(options.plant),
            LAMBDAJET_SEED=str(options.seed),
        )
        self.up = False
        self.found = {}

    def call(self, *command, check=True, tell=None):
        """Runs a command in a session of its own: Ctrl-C reaches only this program, which ends the command and then the cell.
        tell: called with each line that the command says."""
        child = subprocess.Popen(command, env=self.environment, cwd=self.source, stdin=subprocess.DEVNULL, start_new_session=True,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        lines = []
        try:
            for line in child.stdout:
                lines.append(line)
                if tell:
                    tell(line.rstrip())
            child.wait()
        except BaseException:
            os.killpg(child.pid, signal.SIGTERM)
            child.wait()
            raise
        output = "".join(lines)
        if check and child.returncode != 0:
            tail = "\n".join(output.strip().splitlines()[-15:])
            raise StartFailed(f"'{' '.join(command[:3])} …' ended with {child.returncode}:\n{tail}")
        return subprocess.CompletedProcess(command, child.returncode, output)

    def compose(self, *words, check=True):
        return self.call("podman-compose", "-p", self.project, "-f", str(self.source / "deploy" / "compose.yaml"), *words, check=check)

    def make_base(self):
        """A bare Debian 12 from its own packages, where no registry of images is to be had."""
        if self.call("podman", "image", "exists", BASE, check=False).returncode == 0:
            return
        root = self.folder / "base"
        print("  making the base image from Debian's packages (a minute)", flush=True)
        self.call("debootstrap", "--variant=minbase", "bookworm", str(root))
        # The host's way to Debian's packages, as an administrator would set it up in an image of the house.
        apt = root / "etc" / "apt"
        (apt / "sources.list").unlink(missing_ok=True)
        for name in ("sources.list", "sources.list.d", "apt.conf.d", "trusted.gpg.d", "keyrings"):
            there = pathlib.Path("/etc/apt") / name
            if there.is_dir():
                shutil.copytree(there, apt / name, dirs_exist_ok=True)
            elif there.is_file():
                shutil.copy(there, apt / name)
        archive = self.folder / "base.tar"
        self.call("tar", "-C", str(root), "-cf", str(archive), ".")
        self.call("podman", "import", str(archive), BASE)
        shutil.rmtree(root)
        archive.unlink()

    def make_image(self):
        cache = pathlib.Path(os.environ.get("CCACHE_DIR", os.path.expanduser("~/.cache/ccache")))
        cache.mkdir(parents=True, exist_ok=True)
        programs = self.options.container_programs
        if programs == "host":
            packages = self.call(str(self.source / "deploy" / "runtime_packages"), str(self.options.build_folder / "bin")).stdout
            (self.source / "build" / "runtime-packages.txt").write_text(packages)
        console = "from the host's programs" if programs == "host" else "from the sources; ccache has what was compiled before"
        print(f"  making the image {IMAGE} {console}", flush=True)
        began = time.monotonic()
        self.call("buildah", "bud", "--isolation", "chroot", "--layers", "--force-rm", "--build-arg", f"BASE={BASE}",
                  "--build-arg", f"PROGRAMS={programs}", "--volume", f"{cache}:/ccache", "--tag", IMAGE,
                  "--file", "deploy/Containerfile", ".", tell=tell_image_step)
        print(f"  the image is there after {time.monotonic() - began:.0f} s", flush=True)

    def real_time_words(self):
        """Where the kernel shares real-time scheduling out by control group (v1), a container has none unless it asks: podman's
        group gets a share, each module a part of it. Elsewhere SYS_NICE is enough."""
        groups = pathlib.Path("/sys/fs/cgroup/cpu")
        if not (groups / "cpu.rt_runtime_us").exists():
            return []
        try:
            (groups / "libpod_parent").mkdir(exist_ok=True)
            (groups / "libpod_parent" / "cpu.rt_runtime_us").write_text(str(REAL_TIME_US_OF_ALL))
        except OSError as error:
            print(f"  the modules run without real-time priority: {error}", flush=True)
            return []
        return [f"--podman-run-args=--cpu-rt-runtime={REAL_TIME_US_OF_A_MODULE}"]

    def start(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.make_base()
        self.make_image()
        key = self.folder / "key"
        key.write_text(f"1 {secrets.token_hex(32)}\n")
        for path in (self.folder, key):
            os.chown(path, USER, USER)
        key.chmod(0o400)
        started = time.monotonic()
        self.up = True
        done = self.compose(*self.real_time_words(), "up", "-d", *MODULES)
        done.stdout += self.compose("up", "-d", *[name for name in START_ORDER if name not in MODULES]).stdout
        missing = [name for name in START_ORDER if name not in self.inspect()]
        if missing:  # podman-compose ends well whatever podman said
            raise StartFailed(f"podman did not start {', '.join(missing)}:\n{done.stdout.strip()[-2000:]}")
        return started

    def addresses(self):
        """Name -> address in the cell's network, of those that run."""
        if len(self.found) < len(START_ORDER):
            self.found = {name: f"{address}:{PORTS[name]}" for name, (_, _, _, address) in self.inspect().items() if address}
        return self.found

    def container(self, name):
        return f"{self.project}_{name}_1"

    def inspect(self):
        """Name -> (running, exit code, pid, address) of the containers that there are."""
        done = self.call("podman", "ps", "--all", "--quiet", "--filter", f"label=io.podman.compose.project={self.project}")
        if not done.stdout.split():
            return {}
        states = json.loads(self.call("podman", "inspect", *done.stdout.split()).stdout)
        names = {self.container(name): name for name in START_ORDER}
        found = {}
        for container in states:
            state = container["State"]
            networks = container["NetworkSettings"].get("Networks") or {}
            address = next((network.get("IPAddress", "") for network in networks.values()), "")
            found[names[container["Name"]]] = (state["Running"], state["ExitCode"], state["Pid"], address)
        return found

    def check_alive(self):
        for name, (running, code, _, _) in self.inspect().items():
            if not running:
                raise StartFailed(f"{name} ended with exit code {code}: {self.last_words(name)}")

    def last_words(self, name):
        lines = self.call("podman", "logs", "--tail", "1", self.container(name), check=False).stdout.strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def resident_mib(self):
        result = {}
        for name, (_, _, pid, _) in self.inspect().items():
            try:
                with open(f"/proc/{pid}/status", encoding="ascii") as status:
                    result[name] = next(int(line.split()[1]) / 1024.0 for line in status if line.startswith("VmRSS:"))
            except (OSError, StopIteration):
                continue
        return {name: result[name] for name in SEVEN + ("inspection",) if name in result}

    def stop(self):
        """In order, each with time for its own end; then nothing of this cell is left: containers, network, volumes."""
        if not self.up:
            return
        there = self.inspect()
        for name in STOP_ORDER:
            if name in there:
                self.call("podman", "stop", "--time", "10", self.container(name), check=False)
                (self.folder / f"{name}.log").write_text(self.call("podman", "logs", self.container(name), check=False).stdout)
        self.compose("down", "--volumes", check=False)
        self.call("podman", "network", "rm", "--force", f"{self.project}_cell", check=False)
        self.up = False
