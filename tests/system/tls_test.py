"""Live houses over TLS with certificates made by openssl: who trusts the wrong authority, shows no certificate or a foreign one,
or speaks plaintext is turned away; the cell asks trajectory over mutual TLS; plaintext beyond loopback is refused."""

import json
import pathlib
import subprocess
import sys
import tempfile
import time
import types
import unittest

import cell_under_test as under_test
import grpc
from eventually import eventually
from lambdajet_client import cell_pb2, trajectory_pb2, trouble_of

BUILD = pathlib.Path(sys.argv.pop(1))
UNREACHABLE, REFUSED, DONE = 3, 4, 0
PATIENCE_S = 20
PROGRAM = b"G21 G90\nG0 X300 Y300\nM3 P0.3\nG1 X320 F3600\nM5\nM2\n"


class Authority:
    """A certificate authority and what it has signed, all in one folder."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir()
        self.openssl("req", "-x509", *self.new_key("ca"), "-days", "2", "-subj", "/CN=test-ca", "-out", folder / "ca.pem")
        self.ca = folder / "ca.pem"

    @staticmethod
    def openssl(*words):
        subprocess.run(["openssl", *map(str, words)], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)

    def new_key(self, name):
        return ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", self.folder / f"{name}.key"]

    def issue(self, name, unit=None):
        """(certificate, key) of a host on this one, in an organizational unit."""
        request, names, certificate = (self.folder / f"{name}.{end}" for end in ("csr", "cnf", "pem"))
        names.write_text("subjectAltName=IP:127.0.0.1,DNS:localhost\n")
        self.openssl("req", *self.new_key(name), "-subj", f"/OU={unit}/CN={name}" if unit else f"/CN={name}", "-out", request)
        self.openssl("x509", "-req", "-days", "1", "-in", request, "-CA", self.ca, "-CAkey", self.folder / "ca.key", "-CAcreateserial",
                     "-extfile", names, "-out", certificate)
        return certificate, self.folder / f"{name}.key"


class Tls(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="lambdajet-tls-")))
        cls.authority, cls.stranger = Authority(cls.folder / "ours"), Authority(cls.folder / "theirs")
        cls.server, cls.client = cls.authority.issue("server"), cls.authority.issue("client")
        cls.foreign = cls.stranger.issue("client")

    def setUp(self):
        domain = self.enterContext(under_test.private_domain())
        run = self.enterContext(tempfile.TemporaryDirectory(prefix="lambdajet-tls-run-"))
        options = types.SimpleNamespace(machine=under_test.SOURCE / "deploy" / "config" / "machine.yaml", plant=None, seed=1)
        self.processes = under_test.cell_processes.LocalProcesses(
            under_test.SOURCE, BUILD, pathlib.Path(run), options, flags=[f"--bus.domain={domain}", "--metrics.address=127.0.0.1:0"],
            ports=under_test.cell_processes.free_ports(domain))
        self.addCleanup(self.processes.stop)

    def start(self, *names, mutual, further=()):
        """Starts houses over TLS and waits until each has announced itself."""
        self.processes.flags += [f"--rpc.certificate_file={self.server[0]}", f"--rpc.key_file={self.server[1]}"]
        self.processes.flags += [f"--rpc.client_ca_file={self.authority.ca}"] if mutual else []
        for name in names:
            self.processes.flags += further if name == "cell" else []
            self.processes.start_one(name)

        def announced():
            self.processes.check_alive()
            return all(self.processes.announced(name) for name in names)

        eventually(announced, PATIENCE_S, lambda: [self.processes.last_words(name) for name in names])

    def ask(self, *words, ca=None, own=None):
        """(exit code, all that was said)"""
        flags = ["--announce-dir", str(self.processes.folder), "--timeout-s", "5"]
        flags += ["--ca", str(ca)] if ca else []
        flags += ["--certificate", str(own[0]), "--key", str(own[1])] if own else []
        done = subprocess.run([str(BUILD / "bin" / "lambdajet"), *flags, *words], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, timeout=60, check=False)
        return done.returncode, done.stdout.decode()

    def turned_away(self, **flags):
        code, said = self.ask("calibration", "versions", **flags)
        self.assertEqual(code, UNREACHABLE, said)
        self.assertIn("calibration at 127.0.0.1", said)

    def test_a_server_certificate_is_checked_by_the_client(self):
        self.start("calibration", mutual=False)
        code, said = self.ask("calibration", "versions", ca=self.authority.ca)
        self.assertEqual((code, "machine file" in said), (DONE, True), said)
        self.turned_away(ca=self.stranger.ca)
        self.turned_away()  # plaintext to a TLS port

    def test_a_client_must_show_a_certificate_of_the_named_authority(self):
        self.start("calibration", mutual=True)
        code, said = self.ask("calibration", "versions", ca=self.authority.ca, own=self.client)
        self.assertEqual((code, "machine file" in said), (DONE, True), said)
        self.turned_away(ca=self.authority.ca)
        self.turned_away(ca=self.authority.ca, own=self.foreign)
        code, said = self.ask("calibration", "versions", ca=self.authority.ca, own=(self.client[0], self.server[1]))
        self.assertIn("KEY_MISMATCH", said)

    def test_the_cell_asks_trajectory_over_mutual_tls(self):
        self.start("calibration", "trajectory", "cell", mutual=True,
                   further=[f"--trajectory.ca_file={self.authority.ca}", f"--trajectory.certificate_file={self.client[0]}",
                            f"--trajectory.key_file={self.client[1]}"])
        deadline = time.monotonic() + PATIENCE_S
        said = ""
        while "trajectory   SERVING" not in said:
            self.assertLess(time.monotonic(), deadline, said)
            _, said = self.ask("machine", "state", ca=self.authority.ca, own=self.client)

    def python_client(self, own):
        """The Python client with a certificate of its own."""
        credentials = grpc.ssl_channel_credentials(*(path.read_bytes() for path in (self.authority.ca, own[1], own[0])))
        cell = under_test.lambdajet_client.Cell(self.processes.addresses(), credentials)
        self.addCleanup(cell.close)
        return cell

    def submitted_with_roles(self, certificate):
        """What becomes of a job where trajectory knows roles and the cell shows this certificate."""
        shipped = (under_test.SOURCE / "deploy" / "config" / "trajectory.yaml").read_text()
        roles = [line.split('"')[1] for line in shipped.splitlines() if line.startswith("  #   - ")]
        self.assertEqual([role.split(":")[0] for role in roles], ["cell", "cam"])
        self.processes.flags.append(f"--rpc.roles={','.join(roles)},mes: CN=client -> CellService/*")
        self.start("calibration", "trajectory", "cell", mutual=True,
                   further=[f"--trajectory.ca_file={self.authority.ca}", f"--trajectory.certificate_file={certificate[0]}",
                            f"--trajectory.key_file={certificate[1]}"])
        cell = self.python_client(self.client)
        job = cell.jobs.SubmitJob(cell_pb2.SubmitJobRequest(request_id="one", name="a plate", program=PROGRAM), timeout=10).job
        deadline = time.monotonic() + PATIENCE_S
        while job.state == cell_pb2.JOB_STATE_ADMITTING and time.monotonic() < deadline:
            time.sleep(0.05)
            job = cell.jobs.GetJob(cell_pb2.GetJobRequest(job_id=job.job_id), timeout=10).job
        return cell, job

    def test_the_cell_plans_with_the_role_that_the_shipped_file_shows(self):
        cell, job = self.submitted_with_roles(self.authority.issue("cell"))
        self.assertEqual(cell_pb2.JobState.Name(job.state), "JOB_STATE_READY", job)
        with self.assertRaises(grpc.RpcError) as refused:
            cell.trajectory.PlanProgram(trajectory_pb2.PlanProgramRequest(program=PROGRAM), timeout=5)
        trouble = trouble_of(refused.exception)
        self.assertEqual((trouble.code, trouble.reason), (grpc.StatusCode.PERMISSION_DENIED, "ROLE_NOT_ALLOWED"))
        self.assertIn("role mes (CN=client", trouble.message)
        self.assertIn("a certificate of role cell, cam is right", trouble.message)
        planner = self.python_client(self.authority.issue("planner", "cam"))
        self.assertTrue(planner.trajectory.PlanProgram(trajectory_pb2.PlanProgramRequest(program=PROGRAM), timeout=5).plan_id)
        with self.assertRaises(grpc.RpcError) as refused:
            planner.trajectory.StartStreaming(trajectory_pb2.StartStreamingRequest(plan_id=1), timeout=5)
        self.assertEqual(trouble_of(refused.exception).reason, "ROLE_NOT_ALLOWED")

    def test_a_cell_without_a_role_at_trajectory_fails_its_jobs_and_says_why(self):
        _, job = self.submitted_with_roles(self.authority.issue("some-cell"))
        self.assertEqual((cell_pb2.JobState.Name(job.state), job.reason), ("JOB_STATE_FAILED", "ROLE_NOT_ALLOWED"), job)
        self.assertIn("a certificate of role cell, cam is right", job.message)

    def test_a_client_may_call_what_its_role_allows(self):
        roles = ("--rpc.roles=viewer: CN=client -> CalibrationService/Get* CalibrationService/List*,"
                 "operator: OU=operators OU=fitters -> CalibrationService/*")
        self.processes.flags.append(roles)
        self.start("calibration", mutual=True)
        operator, nobody = self.authority.issue("panel", "operators"), self.authority.issue("clerk", "an office\\,OU=operators")

        def ask(own, *words):
            return self.ask("calibration", *words, ca=self.authority.ca, own=own)

        for own in (self.client, operator):
            code, said = ask(own, "versions")
            self.assertEqual((code, "machine file" in said), (DONE, True), said)
        for own, words, role in ((self.client, ("activate", "0"), "viewer"), (nobody, ("versions",), "none"), (nobody, ("activate", "0"), "none")):
            code, said = ask(own, *words)
            self.assertEqual(code, REFUSED, said)
            self.assertIn("ROLE_NOT_ALLOWED", said)
            self.assertIn(f"role {role} (", said)
            self.assertIn("operator is right", said)
        code, said = ask(operator, "activate", "0")
        self.assertEqual(code, DONE, said)
        log = (self.processes.folder / "calibration.log").read_text().splitlines()
        audit = [json.loads(line) for line in log if "rpc_role_refused" in line or "rpc_allowed" in line]
        self.assertEqual([(line["event"], "panel" in line["client"], line["role"]) for line in audit],
                         [("rpc_role_refused", False, "viewer")] + 2 * [("rpc_role_refused", False, "none")]
                         + [("rpc_allowed", True, "operator")])

    def test_roles_need_certificates_and_plaintext_on_loopback_knows_none(self):
        roles = "--rpc.roles=viewer: CN=client -> CalibrationService/Get*"
        own = [f"--rpc.certificate_file={self.server[0]}", f"--rpc.key_file={self.server[1]}"]
        for further, words in ((own, "rpc.roles needs rpc.client_ca_file"),
                               ([*own, f"--rpc.client_ca_file={self.authority.ca}", "--rpc.roles=viewer: everybody -> */*"], "names nobody")):
            refused = subprocess.run([str(BUILD / "bin" / "calibration"), *self.processes.arguments("calibration"), roles, *further],
                                     stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=30, check=False)
            self.assertNotEqual(refused.returncode, 0)
            self.assertIn(words, refused.stdout.decode())
        self.processes.flags.append(roles)
        self.processes.start_one("calibration")
        eventually(lambda: self.processes.announced("calibration"), PATIENCE_S, lambda: self.processes.last_words("calibration"))
        code, said = self.ask("calibration", "activate", "0")
        self.assertEqual(code, DONE, said)

    def test_plaintext_beyond_loopback_is_refused_and_tls_is_served(self):
        refused = subprocess.run([str(BUILD / "bin" / "calibration"), *self.processes.arguments("calibration"), "--rpc.address=0.0.0.0:0"],
                                 stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=30, check=False)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("name a certificate and a key, or say rpc.allow_plaintext: true", refused.stdout.decode())
        self.processes.flags.append("--rpc.address=0.0.0.0:0")
        self.start("calibration", mutual=False)
        code, said = self.ask("calibration", "versions", ca=self.authority.ca)
        self.assertEqual(code, DONE, said)


if __name__ == "__main__":
    unittest.main()
