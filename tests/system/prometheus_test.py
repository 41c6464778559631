"""A real Prometheus scrapes running houses: every target is up, the series that people watch are there under their names with
units, and promtool finds nothing wrong with a page."""

import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import types
import unittest
import urllib.parse
import urllib.request

import cell_under_test as under_test
from eventually import eventually

BUILD = pathlib.Path(sys.argv.pop(1))
SCRAPED = ("calibration", "kinematics", "drive")
PATIENCE_S = 30
# What an operator's board shows; a histogram is asked for by its count.
WATCHED = {
    "calibration": ["lambdajet_calibration_active_version"],
    "kinematics": ["lambdajet_kinematics_model_version", "lambdajet_rpc_duration_seconds_count", "lambdajet_rpc_calls_total"],
    "drive": ["lambdajet_loop_worst_wake_seconds", "lambdajet_path_buffered_seconds"],
}
EVERY_HOUSE = ["lambdajet_ready", "lambdajet_build_info", "lambdajet_clock_error_bound_seconds", "lambdajet_bus_peers",
               "lambdajet_bus_samples_written_total"]


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def fetch(url):
    with urllib.request.urlopen(url, timeout=5) as answer:
        return answer.read().decode()


class Prometheus:
    def __init__(self, folder, targets):
        config = {"global": {"scrape_interval": "500ms", "scrape_timeout": "500ms"},
                  "scrape_configs": [{"job_name": "lambdajet", "static_configs": [
                      {"targets": [f"127.0.0.1:{port}"], "labels": {"house": name}} for name, port in targets.items()]}]}
        file = folder / "prometheus.yml"
        file.write_text(json.dumps(config))  # JSON is YAML
        self.address = f"http://127.0.0.1:{free_port()}"
        self.log = folder / "prometheus.log"
        with self.log.open("wb") as log:
            self.child = subprocess.Popen(
                ["prometheus", f"--config.file={file}", f"--storage.tsdb.path={folder / 'series'}",
                 f"--web.listen-address={self.address.removeprefix('http://')}"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def stop(self):
        self.child.terminate()
        self.child.wait(timeout=20)

    def query(self, expression):
        """House -> value of the newest sample."""
        answer = json.loads(fetch(f"{self.address}/api/v1/query?query={urllib.parse.quote(expression)}"))
        return {entry["metric"].get("house", ""): float(entry["value"][1]) for entry in answer["data"]["result"]}

    def wait_for(self, expression, holds):
        found = None

        def looked():
            nonlocal found
            if self.child.poll() is not None:
                raise AssertionError(f"prometheus has ended: {self.log.read_text()[-1000:]}")
            try:
                found = self.query(expression)
            except OSError as error:  # not listening yet
                found = error
                return None
            return found if holds(found) else None

        return eventually(looked, PATIENCE_S, lambda: f"{expression}: {found}; {self.log.read_text()[-1000:]}")


class RealPrometheus(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="lambdajet-prometheus-")))
        domain = cls.enterClassContext(under_test.private_domain())
        options = types.SimpleNamespace(machine=under_test.SOURCE / "deploy" / "config" / "machine.yaml",
                                        plant=under_test.SOURCE / "deploy" / "plants" / "shipped.yaml", seed=1)
        processes = under_test.cell_processes.LocalProcesses(
            under_test.SOURCE, BUILD, folder, options, flags=[f"--bus.domain={domain}", "--metrics.address=127.0.0.1:0"],
            ports=under_test.cell_processes.free_ports(domain))
        cls.addClassCleanup(processes.stop)
        for name in SCRAPED:
            processes.start_one(name)
        under_test.wait_serving(processes, SCRAPED)
        cls.ports = {name: processes.announced(name)["metrics_port"] for name in SCRAPED}
        cls.prometheus = Prometheus(folder, cls.ports)
        cls.addClassCleanup(cls.prometheus.stop)
        cls.prometheus.wait_for("up == 1", lambda found: set(found) == set(SCRAPED))

    def test_every_house_shows_what_all_have(self):
        for name in EVERY_HOUSE:
            self.prometheus.wait_for(name, lambda found: set(SCRAPED) <= set(found))
        self.assertEqual(self.prometheus.query("lambdajet_ready"), dict.fromkeys(SCRAPED, 1.0))

    def test_every_house_shows_what_is_its_own(self):
        for house, names in WATCHED.items():
            for name in names:
                self.prometheus.wait_for(f'sum by (house) ({name}{{house="{house}"}})', lambda found: house in found)
        calls = self.prometheus.query('sum by (house) (lambdajet_rpc_calls_total{house="kinematics",method=~".*Health/Check",code="OK"})')
        self.assertGreaterEqual(calls.get("kinematics", 0), 1, "the health checks of this test were not counted")

    def test_names_say_their_units_and_counters_end_in_total(self):
        known = json.loads(fetch(f"{self.prometheus.address}/api/v1/targets/metadata"))["data"]
        ours = {entry["metric"]: entry for entry in known if entry["metric"].startswith("lambdajet_")}
        self.assertGreater(len(ours), 20)
        for name, entry in ours.items():
            self.assertTrue(entry["help"], f"{name} says nothing of itself")
            if entry["type"] == "counter":
                self.assertTrue(name.endswith("_total"), name)
            if entry["type"] == "histogram":
                self.assertRegex(name, "_(seconds|meters|bytes)$")
            self.assertIsNone(re.search("_(ms|us|ns|mm|um|milliseconds|micros|kib|mib)(_|$)", name), f"{name}: base units are right")

    def test_promtool_finds_nothing_wrong(self):
        for house, port in self.ports.items():
            page = fetch(f"http://127.0.0.1:{port}/metrics")
            done = subprocess.run(["promtool", "check", "metrics"], input=page, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, check=False)
            ours = [line for line in done.stdout.splitlines() if line.startswith("lambdajet_")]
            self.assertEqual(ours, [], house)


if __name__ == "__main__":
    unittest.main()
