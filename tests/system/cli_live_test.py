"""Every verb of `lambdajet` that asks a service, against a live cell, in people's words and with --json: the exit code, one JSON
value (or one a line) on standard output, nothing there when the verb fails. One short run over two marks is really driven."""

import json
import os
import pathlib
import sys
import unittest

import cell_under_test as under_test
import stages
from lambdajet_shell import DONE, REFUSED, UNREACHABLE, WRONG_STATE, Lambdajet

BUILD = pathlib.Path(sys.argv.pop(1))
HOLES = under_test.SOURCE / "deploy" / "parts" / "tilted_holes" / "tilted_holes.ngc"
os.environ["LAMBDAJET_HEXAPOD_FILE"] = str(under_test.SOURCE / "deploy" / "config" / "hexapod.yaml")
DRAWING = under_test.SOURCE / "deploy" / "parts" / "bracket.drawing.yaml"


class EveryVerb(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.processes, cell = cls.enterClassContext(under_test.cell_under_test(BUILD))
        stages.wait_until_heard(cell)
        cls.folder = cls.processes.folder
        shell = Lambdajet(cls("test_accuracy"), BUILD, cls.folder)
        shell.run("machine", "state", code=WRONG_STATE)  # nothing is referenced yet
        shell.run("machine", "reset")
        cls.program = cls.folder / "verify.ngc"
        shell.run("calibration", "verify", "--program", cls.program, "--looks", 2)
        submitted = shell.ask_json("job", "submit", cls.program, "--name", "two marks", "--request-id", "one")
        cls.job, cls.plan = submitted["job_id"], submitted["plan_id"]
        for verb in ("hold", "resume"):
            shell.run("job", verb, cls.job, code=WRONG_STATE)
        shell.run("inspection", "begin", cls.plan)
        shell.run("job", "start", cls.job)
        cls.watched = shell.run("job", "watch", cls.job, code=(DONE, WRONG_STATE))
        for _ in range(3):  # this host may stand still while the sheet moves; resuming is one of the verbs
            if "INTERRUPTED" not in cls.watched.splitlines()[-1]:
                break
            shell.run("job", "resume", cls.job)
            cls.watched += shell.run("job", "watch", cls.job, code=(DONE, WRONG_STATE))

    def setUp(self):
        self.lambdajet = Lambdajet(self, BUILD, self.folder)

    def test_job(self):
        ask, run, job = self.lambdajet.ask, self.lambdajet.run, self.job
        self.assertIn("COMPLETED", self.watched.splitlines()[-1])
        again = self.lambdajet.ask_json("job", "submit", self.program, "--name", "two marks", "--request-id", "one")
        self.assertEqual(again["job_id"], job, "the same request id is the same job")
        people, shown = ask("job", "show", job)
        self.assertIn(f"{job} COMPLETED", people)
        self.assertEqual((shown["state"], shown["progress"]), ("JOB_STATE_COMPLETED", 1))
        self.assertNotIn("bound 0.000", people, "nobody predicted this bound")
        people, listed = ask("job", "list", "--all")
        self.assertIn("two marks", people)
        self.assertIn(job, [one["job_id"] for one in listed["jobs"]])
        run("job", "list", "--state", "NONSENSE", code=REFUSED)
        trace, events = self.folder / "trace.csv", self.folder / "events.csv"
        _, report = ask("job", "report", job, "--trace", trace, "--events", events)
        self.assertGreater(report["duration_s"], 1)
        self.assertTrue(trace.read_text().startswith("time_s,actuator_1_mm,"))
        self.assertGreater(len(trace.read_text().splitlines()), 30)
        self.assertIn("deviation_mm", events.read_text())
        self.assertEqual(self.lambdajet.ask_json("job", "watch", job)["state"], "JOB_STATE_COMPLETED")
        self.assertIn("COMPLETED", run("job", "start", job), "asked twice, started once")
        run("job", "cancel", job, code=WRONG_STATE)
        run("job", "show", "job-999999", code=REFUSED)
        self.assertIn("0.80", run("job", "override", 0.8))
        self.assertEqual(self.lambdajet.ask_json("job", "override", 1)["feed_override"], 1)
        run("job", "override", 7, code=REFUSED)

    def test_job_cancelled_before_it_ran(self):
        ready = self.lambdajet.ask_json("job", "submit", self.program, "--request-id", "two")["job_id"]
        self.assertIn("CANCELLED", self.lambdajet.run("job", "cancel", ready))

    def test_machine_stop_and_reset(self):
        ask = self.lambdajet.ask
        people, state = ask("machine", "state")
        self.assertIn("may start", people)
        self.assertEqual(state["vetoes"], [])
        modes = {node["name"]: node["mode"] for node in state["nodes"]}
        self.assertEqual((modes["trajectory"], modes["calibration"]), ("SERVING", "SERVING"))
        ask("job", "stop")
        people, stopped = ask("machine", "state", code=WRONG_STATE)
        self.assertIn("reset the machine", people)
        self.assertTrue(stopped["vetoes"])
        self.assertEqual(self.lambdajet.ask_json("machine", "reset")["vetoes"], [])

    def test_calibration(self):
        ask, run, plan = self.lambdajet.ask, self.lambdajet.run, self.plan
        people, verdict = ask("calibration", "verify", "--plan", plan, code=(DONE, WRONG_STATE))
        self.assertTrue(people.startswith(verdict["verdict"]))
        self.assertGreater(verdict["degrees_of_freedom"], 0)
        self.assertIn("G21", run("calibration", "verify", "--program", "-"))
        self.assertIn("G21", self.lambdajet.ask_json("calibration", "verify", "--program", "-")["program"])
        _, planned = ask("calibration", "plan", "--looks", 4, "--trial-pierces", 0, "--skip-elasticity")
        self.assertIn("M100", planned["program"])
        people, runs = ask("calibration", "runs")
        self.assertIn(plan, people)
        self.assertGreater(runs["runs"][0]["looks"], 50)
        people, looks = ask("calibration", "runs", "--plan", plan)
        self.assertTrue(people.startswith("mark,exposure_ns,seen,x_C_mm,"))
        self.assertEqual(len(people.splitlines()) - 1, len(looks["looks"]))
        for words in (("identify", "--plan", plan), ("identify", "--plan", 1), ("activate", 99), ("show", 99), ("diff", 0, 99)):
            run("calibration", *words, code=REFUSED)
            run("--json", "calibration", *words, code=REFUSED)
        people, versions = ask("calibration", "versions")
        self.assertIn("machine file", people)
        self.assertTrue(versions["versions"][0]["active"])
        people, shown = ask("calibration", "show")
        self.assertIn("main_link_length_mm", people)
        self.assertEqual(run("calibration", "show", "--yaml").strip(), shown["machine_yaml"].strip())
        self.assertEqual({one["name"] for one in ask("calibration", "diff", 0, 0)[1]["parameters"]},
                         {one["name"] for one in shown["parameters"]})
        self.assertEqual(ask("calibration", "activate", 0, "--author", "a test")[1]["model_version"]["version"], 0)

    def test_accuracy(self):
        ask, run = self.lambdajet.ask, self.lambdajet.run
        cutting = self.lambdajet.ask_json("job", "submit", under_test.SOURCE / "tests" / "system" / "kill_plate.ngc", "--request-id", "cut")
        people, predicted = ask("accuracy", "ask-predict", cutting["plan_id"], "--draws", 50)
        self.assertGreater(predicted["predicted_95_mm"], 0.1)
        self.assertIn(f"{predicted['predicted_95_mm']:.4f}", people)
        self.assertIn("NO_CUTTING", run("accuracy", "ask-predict", self.plan))
        run("accuracy", "ask-predict", 1, code=REFUSED)
        people, error_map = ask("accuracy", "ask-map", "--columns", 3, "--rows", 3)
        self.assertEqual(len(people.splitlines()), 10)
        self.assertEqual(len(error_map["values"]), 36)
        run("accuracy", "ask-map", "--columns", 1, code=REFUSED)
        people, budget = ask("accuracy", "ask-budget", "--shift-mm", 0.3, 0, 0, 0.4)
        self.assertAlmostEqual(budget["base_mm"], 0.5)
        self.assertIn("0.5000 mm", people)

    def test_trajectory(self):
        ask, run = self.lambdajet.ask, self.lambdajet.run
        part = under_test.SOURCE / "tests" / "system" / "kill_plate.ngc"
        people, checked = ask("trajectory", "ask-check", part)
        self.assertIn("admitted", people)
        self.assertTrue(checked["admitted"])
        told = "where the programmed feed is not held"
        asked = run("trajectory", "ask-plan", part)
        here = run("trajectory", "plan", part, "--machine", under_test.SOURCE / "deploy" / "config" / "machine.yaml")
        self.assertEqual(asked[asked.index(told):].strip(), here[here.index(told):].strip(), "the same table here and there")
        people, planned = ask("trajectory", "ask-plan", part, "--compensate")
        plan = planned["summary"]["plan_id"]
        self.assertIn("contour tolerance used", people)
        self.assertEqual(ask("trajectory", "show", plan)[1]["summary"]["plan_id"], plan)
        people, listed = ask("trajectory", "list")
        self.assertIn(plan, people)
        self.assertIn(plan, [one["plan_id"] for one in listed["plans"]])
        samples = run("trajectory", "samples", plan, "--step-s", 0.05)
        self.assertTrue(samples.startswith("tau_s,s_mm,"))
        exported = run("trajectory", "export", "--plan", plan, "--step-s", 0.05)
        self.assertEqual(len(exported.splitlines()), len(samples.splitlines()))
        self.assertIn("PIERCE", run("trajectory", "export", "--program", part))
        self.assertIn("M3", run("trajectory", "export", "--program", part, "--as", "gcode"))
        self.assertIn("AUXFUN/3,0.6", run("trajectory", "export", "--plan", plan, "--as", "cldata"))
        self.assertEqual(ask("trajectory", "watch", plan)[1]["summary"]["plan_id"], plan)
        people = run("trajectory", "admit", part, "--tolerance-mm", 5, "--tolerance-contour", "1=4")
        for step in ("PARSE", "PLACE", "REACH", "LIMITS", "TIME", "ACCURACY"):
            self.assertRegex(people, f"{step} +passed")
        steps = [json.loads(line) for line in run("--json", "trajectory", "admit", part).splitlines()]
        self.assertEqual(steps[-1]["step"], "ACCURACY")
        run("trajectory", "show", 7, code=REFUSED)
        run("trajectory", "watch", 7, code=REFUSED)
        run("trajectory", "export", "--plan", 7, code=REFUSED)

    def test_trajectory_of_a_hexapod(self):
        ask, run = self.lambdajet.ask, self.lambdajet.run
        hexapod = ("--mechanism", "hexapod")
        people = run("trajectory", "admit", HOLES, *hexapod)
        for step in ("PARSE", "PLACE", "REACH", "LIMITS", "TIME"):
            self.assertRegex(people, f"{step} +passed")
        self.assertIn("singular margin", people)
        people, planned = ask("trajectory", "ask-plan", HOLES, *hexapod)
        plan = planned["summary"]["plan_id"]
        self.assertGreater(planned["summary"]["spatial"]["longest_strut_mm"], 1000)
        self.assertTrue(ask("trajectory", "ask-check", HOLES, *hexapod)[1]["admitted"])
        samples = run("trajectory", "samples", plan, "--step-s", 0.05)
        self.assertTrue(samples.startswith("tau_s,s_mm,x_W_mm,y_W_mm,z_W_mm,a_rad,"))
        exported = run("trajectory", "export", "--plan", plan, "--step-s", 0.05)
        self.assertEqual(len(exported.splitlines()), len(samples.splitlines()))
        self.assertIn("b_rad=", run("trajectory", "export", "--program", HOLES, *hexapod))
        cldata = self.folder / "holes.cldata"
        cldata.write_text(run("trajectory", "export", "--plan", plan, "--as", "cldata"))
        again = self.lambdajet.ask_json("trajectory", "ask-plan", cldata, *hexapod)
        self.assertAlmostEqual(again["summary"]["duration_s"], planned["summary"]["duration_s"], places=6)
        run("trajectory", "ask-plan", HOLES, *hexapod, "--tolerance-mm", 1, code=REFUSED)

    def test_inspection(self):
        ask, run, plan = self.lambdajet.ask, self.lambdajet.run, self.plan
        people, ended = ask("inspection", "end", plan)
        self.assertGreater(int(ended["samples"]), 1000)
        people = run("inspection", "path", plan)
        self.assertTrue(people.startswith("time_s,x_W_mm,y_W_mm,jet_on\n"))
        rows = [json.loads(line)["values"] for line in run("--json", "inspection", "path", plan).splitlines()]
        self.assertEqual(sum(len(batch) // 4 for batch in rows), len(people.splitlines()) - 1)
        _, found = ask("inspection", "ask-compare", plan, "--drawing", DRAWING, "--deviations", self.folder / "deviations.csv")
        self.assertGreater(found["all"]["not_cut"], 0, "the camera cuts nothing")
        self.assertIn("deviation_mm", (self.folder / "deviations.csv").read_text())
        run("inspection", "ask-compare", 1, "--drawing", DRAWING, code=REFUSED)
        self.assertIn("kept from now on", run("inspection", "begin", 4711))
        self.lambdajet.ask_json("inspection", "begin", 4711)
        run("inspection", "path", 4711, code=REFUSED)

    def test_a_service_that_is_not_there_is_named(self):
        said = Lambdajet(self, BUILD, self.folder).run("--address", "cell=127.0.0.1:1", "--timeout-s", 5, "job", "list", code=UNREACHABLE)
        self.assertRegex(said, "cell at 127.0.0.1:1 does not answer")


if __name__ == "__main__":
    unittest.main()
