"""A process that cannot start says so in one clear message, with what to do next, and exits non-zero."""

import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

import cell_under_test as under_test

BUILD = pathlib.Path(sys.argv.pop(1))
CONFIG = under_test.SOURCE / "deploy" / "config"


def flags_of(name, domain, folder):
    """What each house needs to come up on loopback, on free ports, with its files in the folder."""
    flags = [f"--config={CONFIG / (name + '.yaml')}", "--rpc.address=127.0.0.1:0", "--metrics.address=127.0.0.1:0",
             f"--bus.domain={domain}"]
    if name == "calibration":
        flags += [f"--machine={CONFIG / 'machine.yaml'}"]
    if name in ("calibration", "cell"):
        flags += [f"--store={folder}/{name}.sqlite"]
    if name in ("drive", "main_motion"):
        flags += [f"--plant={under_test.SOURCE / 'deploy' / 'plants' / 'shipped.yaml'}"]
    return flags


def start(name, *flags):
    return subprocess.Popen([str(BUILD / "bin" / name), *flags], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT)


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
            self.assertIn("--config names it", said, name)

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
                for setting in ("rpc.address", "metrics.address"):
                    code, said = run(name, *flags_of(name, domain, folder), f"--{setting}=127.0.0.1:{port}")
                    self.assertNotEqual(code, 0, name)
                    self.assertIn(f"127.0.0.1:{port}", said, name)
                    self.assertIn(f"{setting} may end in port 0 for a free port", said, name)

    def test_every_process_refuses_an_announce_file_that_it_could_not_write(self):
        with under_test.private_domain() as domain, tempfile.TemporaryDirectory() as folder:
            for name in under_test.HOUSES:
                code, said = run(name, *flags_of(name, domain, folder), f"--announce_file={folder}/nowhere/{name}.json")
                self.assertNotEqual(code, 0, name)
                self.assertIn(f"announce_file: cannot create a file beside {folder}/nowhere/{name}.json: No such file", said, name)
                self.assertIn("name a file in a folder that exists", said, name)
            code, said = run("drive", *flags_of("drive", domain, folder), f"--announce_file={folder}")
            self.assertNotEqual(code, 0)
            self.assertIn(f"announce_file: cannot write {folder}: Is a directory", said)

    def test_a_house_whose_announce_folder_goes_before_it_is_ready_ends(self):
        with under_test.private_domain() as domain, tempfile.TemporaryDirectory() as folder:
            gone = pathlib.Path(folder) / "gone"
            gone.mkdir()
            waiting = start("kinematics", *flags_of("kinematics", domain, folder), f"--announce_file={gone}/kinematics.json")
            self.addCleanup(waiting.kill)
            first = ""  # it serves, and is not ready before it has heard of a machine
            while '"event":"started"' not in first:
                first = waiting.stdout.readline().decode()
                self.assertNotEqual(first, "", "kinematics ended before it served")
            gone.rmdir()
            teller = start("calibration", *flags_of("calibration", domain, folder))
            self.addCleanup(teller.kill)
            said, _ = waiting.communicate(timeout=30)
            self.assertNotEqual(waiting.returncode, 0)
            self.assertIn(f"{gone}/kinematics.json: No such file or directory", said.decode())
            teller.terminate()
            teller.communicate(timeout=30)

    def test_files_that_are_missing_are_named_with_what_to_do(self):
        with under_test.private_domain() as domain, tempfile.TemporaryDirectory() as folder:
            for setting, advice in (("bus.key_file", "openssl rand -hex 32"), ("rpc.certificate_file", "a PEM file that this user may read is right"),
                                    ("bus.profile_file", "deploy/dds/profiles.xml is the one to name")):
                code, said = run("kinematics", *flags_of("kinematics", domain, folder), f"--{setting}=/nowhere/at-all")
                self.assertNotEqual(code, 0, setting)
                self.assertIn("/nowhere/at-all", said, setting)
                self.assertIn(advice, said, setting)

    def test_stores_that_cannot_be_written_are_named(self):
        for name in ("calibration", "cell"):
            flags = [f"--config={CONFIG / (name + '.yaml')}", "--rpc.address=127.0.0.1:0", "--metrics.address=127.0.0.1:0",
                     "--store=/proc/nowhere/store.sqlite"]
            if name == "calibration":
                flags += [f"--machine={CONFIG / 'machine.yaml'}"]
            code, said = run(name, *flags)
            self.assertNotEqual(code, 0, name)
            self.assertIn("/proc/nowhere/store.sqlite", said, name)
            self.assertRegex(said, "a writable folder is right|name a file in a folder that exists", name)


if __name__ == "__main__":
    unittest.main()
