"""A process that cannot start says so in one clear message and exits non-zero."""

import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

import cell_under_test as under_test

BUILD = pathlib.Path(sys.argv.pop(1))
CONFIG = under_test.SOURCE / "deploy" / "config"


def run(name, *flags):
    """Exit code and everything it said; it must end by itself."""
    done = subprocess.run([str(BUILD / "bin" / name), *flags], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=30, check=False)
    return done.returncode, done.stdout.decode(errors="replace")


class StartTrouble(unittest.TestCase):
    def test_every_process_refuses_a_missing_config(self):
        for name in under_test.HOUSES:
            code, said = run(name, "--config=/nowhere/at-all.yaml")
            self.assertNotEqual(code, 0, name)
            self.assertIn("/nowhere/at-all.yaml", said, name)

    def test_every_process_refuses_an_unknown_key_with_file_and_line(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in under_test.HOUSES:
                file = pathlib.Path(folder) / f"{name}.yaml"
                file.write_text("machine_id: demo\nrpc:\n  adress: 127.0.0.1:0\n")
                code, said = run(name, f"--config={file}")
                self.assertNotEqual(code, 0, name)
                self.assertIn(f"{file}:3", said, name)
                self.assertIn("rpc.address", said, name)

    def test_every_process_names_the_port_that_is_taken(self):
        with socket.socket() as taken, under_test.private_domain() as domain, tempfile.TemporaryDirectory() as folder:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            port = taken.getsockname()[1]
            for name in under_test.HOUSES:
                flags = [f"--config={CONFIG / (name + '.yaml')}", f"--rpc.address=127.0.0.1:{port}", "--metrics.address=127.0.0.1:0",
                         f"--bus.domain={domain}"]
                if name == "calibration":
                    flags += [f"--machine={CONFIG / 'machine.yaml'}"]
                if name in ("calibration", "cell"):
                    flags += [f"--store={folder}/{name}.sqlite"]
                if name in ("drive", "main_motion"):
                    flags += [f"--plant={under_test.SOURCE / 'deploy' / 'plants' / 'shipped.yaml'}"]
                code, said = run(name, *flags)
                self.assertNotEqual(code, 0, name)
                self.assertIn(str(port), said, name)

    def test_stores_that_cannot_be_written_are_named(self):
        for name in ("calibration", "cell"):
            flags = [f"--config={CONFIG / (name + '.yaml')}", "--rpc.address=127.0.0.1:0", "--metrics.address=127.0.0.1:0",
                     "--store=/proc/nowhere/store.sqlite"]
            if name == "calibration":
                flags += [f"--machine={CONFIG / 'machine.yaml'}"]
            code, said = run(name, *flags)
            self.assertNotEqual(code, 0, name)
            self.assertIn("/proc/nowhere/store.sqlite", said, name)


if __name__ == "__main__":
    unittest.main()
