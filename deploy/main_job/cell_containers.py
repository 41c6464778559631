"""The cell as containers: builds the image once, brings deploy/compose.yaml up, and takes it down again."""

import json
import os
import secrets
import shutil
import subprocess
import time

from cell_processes import SEVEN, START_ORDER, StartFailed

BASE = os.environ.get("LAMBDAJET_CONTAINER_BASE", "localhost/debian:bookworm-slim")
IMAGE = "localhost/lambdajet"
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


class Containers:
    """The same face as cell_processes.LocalProcesses."""

    def __init__(self, source, run_folder, options):
        self.source = source
        self.folder = run_folder
        self.options = options
        self.environment = dict(
            os.environ,
            CONTAINERS_CONF=str(source / "deploy" / "containers.conf"),
            LAMBDAJET_RUN=str(run_folder),
            LAMBDAJET_MACHINE=str(options.machine),
            LAMBDAJET_PLANT=str(options.plant),
            LAMBDAJET_SEED=str(options.seed),
        )
        self.up = False

    def call(self, *command, check=True):
        done = subprocess.run(command, env=self.environment, cwd=self.source, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if check and done.returncode != 0:
            tail = "\n".join(done.stdout.strip().splitlines()[-15:])
            raise StartFailed(f"'{' '.join(command[:3])} …' ended with {done.returncode}:\n{tail}")
        return done

    def compose(self, *words, check=True):
        return self.call("podman-compose", "-p", "lambdajet", "-f", str(self.source / "deploy" / "compose.yaml"), *words, check=check)

    def make_base(self):
        """A bare Debian 12 from its own packages, where no registry of images is to be had."""
        if self.call("podman", "image", "exists", BASE, check=False).returncode == 0:
            return
        root = self.folder / "base"
        print("  making the base image from Debian's packages (a minute)", flush=True)
        self.call("debootstrap", "--variant=minbase", "bookworm", str(root))
        # The host's way to Debian's packages, as an administrator would set it up in an image of the house.
        for name in ("sources.list.d", "apt.conf.d"):
            shutil.copytree(f"/etc/apt/{name}", root / "etc" / "apt" / name, dirs_exist_ok=True)
        archive = self.folder / "base.tar"
        self.call("tar", "-C", str(root), "-cf", str(archive), ".")
        self.call("podman", "import", str(archive), BASE)
        shutil.rmtree(root)
        archive.unlink()

    def make_image(self):
        cache = os.environ.get("CCACHE_DIR", os.path.expanduser("~/.cache/ccache"))
        os.makedirs(cache, exist_ok=True)
        print("  building the image (as long as a build, less what ccache holds)", flush=True)
        self.call("buildah", "bud", "--isolation", "chroot", "--layers", "--build-arg", f"BASE={BASE}", "--volume", f"{cache}:/ccache",
                  "--tag", IMAGE, "--file", "deploy/Containerfile", ".")

    def start(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        self.make_base()
        self.make_image()
        key = self.folder / "key"
        key.write_text(f"1 {secrets.token_hex(32)}\n")
        for path in (self.folder, key):
            os.chown(path, USER, USER)
        key.chmod(0o400)
        self.compose("down", check=False)
        started = time.monotonic()
        self.up = True
        self.compose("up", "-d")
        return started

    def addresses(self):
        """Name -> address in the cell's network, of those that run."""
        return {name: f"{address}:{PORTS[name]}" for name, (_, _, _, address) in self.inspect().items() if address}

    def container(self, name):
        return f"lambdajet_{name}_1"

    def inspect(self):
        """Name -> (running, exit code, pid, address)."""
        done = self.call("podman", "inspect", *[self.container(name) for name in START_ORDER], check=False)
        try:
            states = json.loads(done.stdout)
        except ValueError:
            return {}
        found = {}
        for name, container in zip(START_ORDER, states):
            state = container["State"]
            networks = container["NetworkSettings"].get("Networks") or {}
            address = next((network.get("IPAddress", "") for network in networks.values()), "")
            found[name] = (state["Running"], state["ExitCode"], state["Pid"], address)
        return found

    def check_alive(self):
        for name, (running, code, _, _) in self.inspect().items():
            if not running and code != 0:
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
        if not self.up:
            return
        for name in START_ORDER:
            log = self.call("podman", "logs", self.container(name), check=False).stdout
            (self.folder / f"{name}.log").write_text(log)
        self.compose("down", check=False)
        self.up = False
