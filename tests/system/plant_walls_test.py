"""No service and no controller sees the simulated machine's truth: proven on the programs and libraries as they were linked."""

import pathlib
import subprocess
import sys
import unittest

BUILD = pathlib.Path(sys.argv.pop(1))
SERVICES = ("kinematics", "calibration", "trajectory", "accuracy", "cell")
MODULES = ("drive", "main_motion")
TRUTH_TOPICS = (b"plant/drive_truth", b"plant/jet_truth")


def symbols(path):
    listing = subprocess.run(["nm", "-C", str(path)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False).stdout
    return listing.decode(errors="replace")


class PlantWalls(unittest.TestCase):
    def test_the_check_can_see_a_plant(self):
        for module in MODULES:
            self.assertIn("simulated_plant", symbols(BUILD / "bin" / module))
        self.assertIn(TRUTH_TOPICS[0], (BUILD / "bin" / "inspection").read_bytes())

    def test_no_service_contains_the_plant_or_its_file_reader(self):
        for service in SERVICES:
            self.assertNotIn("simulated_plant", symbols(BUILD / "bin" / service), service)

    def test_no_service_knows_the_name_of_a_truth_topic(self):
        for service in SERVICES:
            program = (BUILD / "bin" / service).read_bytes()
            for topic in TRUTH_TOPICS:
                self.assertFalse(topic in program, f"{service} holds the words {topic.decode()}")

    def test_no_modules_core_refers_to_a_plant(self):
        for module in MODULES:
            libraries = list(BUILD.rglob(f"lib{module}_core.a"))
            self.assertEqual(len(libraries), 1)
            self.assertNotIn("simulated_plant", symbols(libraries[0]), module)


if __name__ == "__main__":
    unittest.main()
