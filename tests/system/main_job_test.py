"""The whole main job as deploy/demo runs it, on free ports and a domain of its own; the figures of the report are judged."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import cell_under_test as under_test

BUILD = pathlib.Path(sys.argv.pop(1))
MAIN_JOB = under_test.SOURCE / "deploy" / "main_job" / "main_job.py"
STAGES = ["as set up", "identified", "identified and compensated"]


class MainJob(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lambdajet-main-job-")
        with under_test.private_domain() as domain:
            done = subprocess.run(
                [sys.executable, str(MAIN_JOB), "--build-folder", str(BUILD), "--out", cls.folder.name, "--domain", str(domain),
                 "--free-ports"],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=800, check=False)
        print(done.stdout.decode())
        cls.code = done.returncode
        report = pathlib.Path(cls.folder.name) / "report.json"
        cls.report = json.loads(report.read_text()) if report.exists() else None

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def setUp(self):
        self.assertEqual(self.code, 0)

    def stage(self, name):
        return next(stage for stage in self.report["stages"] if stage["name"] == name)

    def test_every_stage_cut_the_whole_part_and_the_judge_missed_nothing(self):
        self.assertEqual([stage["name"] for stage in self.report["stages"]], STAGES)
        for stage in self.report["stages"]:
            self.assertEqual(stage["points_not_cut"], 0, stage["name"])
            self.assertEqual(stage["truth_missing_ms"], 0, stage["name"])

    def test_the_shipped_plant_reproduces_the_paper_and_the_cure_works(self):
        self.assertGreaterEqual(self.stage("as set up")["p95_mm"], 0.6)
        self.assertLessEqual(self.stage("as set up")["p95_mm"], 0.9)
        self.assertLessEqual(self.stage("identified")["p95_mm"], 0.45)
        self.assertLessEqual(self.stage("identified and compensated")["p95_mm"], 0.12)

    def test_the_prediction_holds_and_is_not_silly(self):
        for stage in self.report["stages"]:
            self.assertGreaterEqual(stage["predicted_95_mm"], stage["p95_mm"], stage["name"])
        self.assertLessEqual(self.stage("identified and compensated")["predicted_95_mm"], 0.3)

    def test_process_events_fall_where_they_should(self):
        for stage in self.report["stages"]:
            self.assertGreater(stage["events_in_motion"], 0)
            self.assertLessEqual(stage["event_deviation_p50_mm"], 0.02, stage["name"])

    def test_memory_stays_small(self):
        for when in ("idle", "after"):
            for name, mib in self.report["resident_mib"][when].items():
                if name != "inspection":
                    self.assertLessEqual(mib, 80.0, f"{name} {when}")

    def test_the_pictures_are_there(self):
        page = (pathlib.Path(self.folder.name) / "report.html").read_text()
        self.assertGreaterEqual(page.count("<svg"), 7)
        self.assertNotIn("nan", page.lower().replace("nanosecond", ""))


if __name__ == "__main__":
    unittest.main()
