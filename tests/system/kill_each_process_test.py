"""Kills each of the seven processes in turn, without warning, while the jet cuts, and looks at what the link promises:
the other module is safe within its deadline, the job is not lost, resume is offered, and the part is whole in the end."""

import contextlib
import json
import pathlib
import sys
import unittest

import cell_under_test as under_test
from eventually import eventually
import stages
from lambdajet_client import cell_pb2, inspection_pb2

BUILD = pathlib.Path(sys.argv.pop(1))
PROGRAM = (pathlib.Path(__file__).parent / "kill_plate.ngc").read_text()
DRAWING = (pathlib.Path(__file__).parent / "kill_plate.drawing.yaml").read_text()
# The modules' own deadline, plus what this host may be late in waking them; printed beside what was measured.
DETECTION_LIMIT_S = 0.25
QUIET_VICTIMS = ("kinematics", "calibration", "accuracy")


def log_lines(processes, name):
    for line in (processes.folder / f"{name}.log").read_text(errors="replace").splitlines():
        with contextlib.suppress(ValueError):
            yield json.loads(line)


def reaction_s(processes, name, killed_ns):
    """Seconds from the kill until the survivor's core changed its mode because it missed its peer, or None."""
    for line in log_lines(processes, name):
        if line.get("reason") == "PEER_LOST" and line["common_time_ns"] > killed_ns:
            return (line["common_time_ns"] - killed_ns) * 1e-9
    return None


class KillEachProcess(unittest.TestCase):
    def setUp(self):
        self.processes, self.cell = self.enterContext(under_test.cell_under_test(BUILD))
        stages.reference(self.cell)

    def job(self, job_id):
        return self.cell.jobs.GetJob(cell_pb2.GetJobRequest(job_id=job_id), timeout=10).job

    def wait_job(self, job_id, holds, deadline_s=40):
        job = None

        def reached():
            nonlocal job
            with contextlib.suppress(Exception):  # the cell itself may be the one that was killed
                job = self.job(job_id)
                return job if holds(job) else None
            return None

        return eventually(reached, deadline_s, lambda: f"the job is {job}")

    def kill_while_cutting(self, victim):
        """Runs the plate, kills the victim at about a third of the way; returns (job id, instant of the kill)."""
        job = stages.submit(self.cell, f"kill {victim}", PROGRAM, False, f"kill-{victim}")
        self.cell.inspection.BeginRecording(inspection_pb2.BeginRecordingRequest(plan_id=job.plan_id), timeout=10)
        self.cell.jobs.StartJob(cell_pb2.StartJobRequest(job_id=job.job_id), timeout=20)
        self.wait_job(job.job_id, lambda j: j.state == cell_pb2.JOB_STATE_RUNNING and j.progress > 0.3)
        return job.job_id, self.processes.kill(victim)

    def restart(self, *victims):
        for victim in victims:
            self.processes.start_one(victim)
        under_test.wait_serving(self.processes, victims)

    def finish(self, job_id):
        """Resumes if that is offered, waits for the end, and has the judge look at the plate."""
        job = self.wait_job(job_id, lambda j: j.state in (cell_pb2.JOB_STATE_COMPLETED, cell_pb2.JOB_STATE_INTERRUPTED))
        first_plan = job.plan_ids[0]
        if job.state == cell_pb2.JOB_STATE_INTERRUPTED:
            resumed = self.cell.jobs.ResumeJob(cell_pb2.ResumeJobRequest(job_id=job_id), timeout=60).job
            self.cell.inspection.BeginRecording(
                inspection_pb2.BeginRecordingRequest(plan_id=first_plan, further_plan_ids=list(resumed.plan_ids)[1:]), timeout=10)
        job = self.wait_job(job_id, lambda j: j.state == cell_pb2.JOB_STATE_COMPLETED)
        self.cell.inspection.EndRecording(inspection_pb2.EndRecordingRequest(plan_id=first_plan), timeout=10)
        found = self.cell.inspection.Inspect(
            inspection_pb2.InspectRequest(plan_id=first_plan, drawing_yaml=DRAWING), timeout=60)
        self.assertEqual(found.all.not_cut, 0, "the plate is not cut all round")
        return job

    def test_services_that_only_calculate_change_nothing(self):
        job_id, _ = self.kill_while_cutting(QUIET_VICTIMS[0])
        for victim in QUIET_VICTIMS[1:]:
            self.assertEqual(self.job(job_id).state, cell_pb2.JOB_STATE_RUNNING, f"before {victim} is killed")
            self.processes.kill(victim)
        job = self.wait_job(job_id, lambda j: j.state not in (cell_pb2.JOB_STATE_RUNNING,))
        self.assertEqual(job.state, cell_pb2.JOB_STATE_COMPLETED)
        self.restart(*QUIET_VICTIMS)
        self.finish(job_id)

    def test_trajectory_lost_is_a_hold_at_most_and_goes_on(self):
        job_id, _ = self.kill_while_cutting("trajectory")
        job = self.wait_job(job_id, lambda j: j.state in (cell_pb2.JOB_STATE_HELD, cell_pb2.JOB_STATE_COMPLETED), 20)
        self.assertEqual(job.state, cell_pb2.JOB_STATE_HELD, "the plate is longer than the buffer, the drive must have held")
        self.restart("trajectory")
        self.finish(job_id)

    def test_cell_lost_changes_nothing_and_the_job_is_not_lost(self):
        job_id, _ = self.kill_while_cutting("cell")
        self.restart("cell")
        job = self.finish(job_id)
        self.assertEqual(len(job.plan_ids), 1, "nothing had to be resumed")

    def test_drive_lost_turns_the_jet_off_and_resume_finishes_the_part(self):
        job_id, killed = self.kill_while_cutting("drive")
        self.wait_job(job_id, lambda j: j.state == cell_pb2.JOB_STATE_INTERRUPTED)
        reaction = reaction_s(self.processes, "main_motion", killed)
        self.assertIsNotNone(reaction, "main motion did not say that it lost the drive")
        print(f"main motion turned the jet off {1000 * reaction:.1f} ms after the drive was killed")
        self.assertLess(reaction, DETECTION_LIMIT_S)
        self.restart("drive")
        self.finish(job_id)

    def test_main_motion_lost_holds_the_drive_and_resume_finishes_the_part(self):
        job_id, killed = self.kill_while_cutting("main_motion")
        self.wait_job(job_id, lambda j: j.state == cell_pb2.JOB_STATE_INTERRUPTED)
        reaction = reaction_s(self.processes, "drive", killed)
        self.assertIsNotNone(reaction, "the drive did not say that it lost main motion")
        print(f"the drive began its hold {1000 * reaction:.1f} ms after main motion was killed")
        self.assertLess(reaction, DETECTION_LIMIT_S)
        self.restart("main_motion")
        self.finish(job_id)


if __name__ == "__main__":
    unittest.main()
