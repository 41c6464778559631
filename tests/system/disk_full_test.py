"""The disk fills up while the sheet moves: the job goes on, what cannot be written is refused with its reason, nobody ends, and when
there is room again everything is in the journal, also after a kill."""

import contextlib
import pathlib
import subprocess
import sys
import tempfile
import unittest

import cell_under_test as under_test
from eventually import eventually
import grpc
import stages
from lambdajet_client import calibration_pb2, cell_pb2

BUILD = pathlib.Path(sys.argv.pop(1))
DISK_MIB = 16
PATIENCE_S = 30


class DiskFull(unittest.TestCase):
    def setUp(self):
        self.disk = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="lambdajet-disk-")))
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(self.disk)], stdin=subprocess.DEVNULL,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        if mounted.returncode != 0:
            self.skipTest(f"a small disk cannot be mounted here: {mounted.stdout.strip()}")
        self.addCleanup(subprocess.run, ["umount", str(self.disk)], check=True)
        # Stores, announce files and logs of the cell all lie on the small disk.
        self.addCleanup(setattr, tempfile, "tempdir", tempfile.tempdir)
        tempfile.tempdir = str(self.disk)
        self.processes, self.cell = self.enterContext(under_test.cell_under_test(BUILD))
        stages.reference(self.cell)

    def fill(self):
        with (self.disk / "filler").open("wb", buffering=0) as filler, contextlib.suppress(OSError):
            while filler.write(bytes(1024)) == 1024:
                pass

    def job(self, job_id):
        return self.cell.jobs.GetJob(cell_pb2.GetJobRequest(job_id=job_id), timeout=10).job

    def vetoes(self):
        return " ".join(self.cell.jobs.GetMachineState(cell_pb2.GetMachineStateRequest(), timeout=10).state.vetoes)

    def wait_until(self, holds, what):
        eventually(holds, PATIENCE_S, lambda: what)

    def refused(self, call):
        """The words of a call that must be refused because the disk is full."""
        with self.assertRaises(grpc.RpcError) as caught:
            call()
        self.assertEqual(caught.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, caught.exception.details())
        self.assertIn("make room on", caught.exception.details())
        self.assertIn(str(self.disk), caught.exception.details(), "which file could not be written")

    def submit(self, program, request_id):
        return self.cell.jobs.SubmitJob(
            cell_pb2.SubmitJobRequest(request_id=request_id, name=request_id, program=program.encode()), timeout=20).job

    def test_a_job_that_runs_goes_on_and_nothing_is_lost(self):
        program = self.cell.calibration.PlanVerification(calibration_pb2.PlanVerificationRequest(looks=2), timeout=20).program
        job = stages.submit(self.cell, "runs on", program, False, "runs-on")
        self.cell.jobs.StartJob(cell_pb2.StartJobRequest(job_id=job.job_id), timeout=20)
        self.fill()
        self.refused(lambda: self.submit(program, "too-late"))
        self.wait_until(lambda: self.job(job.job_id).state in stages.ENDED + (cell_pb2.JOB_STATE_INTERRUPTED,), "the job did not end")
        ended_as = self.job(job.job_id).state
        self.assertIn("JOURNAL_FAILED", self.vetoes())
        self.refused(lambda: self.cell.calibration.StartIdentification(
            calibration_pb2.StartIdentificationRequest(plan_id=job.plan_id, author="a test"), timeout=20))
        self.processes.check_alive()

        (self.disk / "filler").unlink()
        self.wait_until(lambda: "JOURNAL_FAILED" not in self.vetoes(), "there is room, and the journal is still not written")
        later = self.submit(program, "too-late")
        self.wait_until(lambda: self.job(later.job_id).state == cell_pb2.JOB_STATE_READY, "the job that had been refused")
        self.processes.kill("cell")
        self.processes.start_one("cell")
        under_test.wait_serving(self.processes, ["cell"])
        self.assertEqual(self.job(job.job_id).state, ended_as, "what happened while the disk was full")
        self.assertEqual(self.job(later.job_id).state, cell_pb2.JOB_STATE_READY)


if __name__ == "__main__":
    unittest.main()
