"""Proves that each tidy check can fail: every rule is broken once in a small tree and must be reported there."""
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import check_headers  # noqa: E402
import check_layers  # noqa: E402
import check_names  # noqa: E402
import check_sizes  # noqa: E402

GOOD = "// Says something whole.\n#pragma once\n"


class Tree:
    """A folder with the given files."""

    def __init__(self, contents):
        self.folder = tempfile.TemporaryDirectory()
        for path, text in contents.items():
            full = os.path.join(self.folder.name, path)
            os.makedirs(os.path.dirname(full), exist_ok=True)
            with open(full, "w", encoding="utf-8") as file:
                file.write(text)

    def findings(self, check):
        found = list(check(self.folder.name))
        self.folder.cleanup()
        return found


class Layers(unittest.TestCase):
    # path, include that must be refused there
    REFUSED = [
        ("services/foundation/contract/a.hpp", "foundation/geometry/b.hpp"),
        ("services/foundation/machine/a.hpp", "kinematics/core/b.hpp"),
        ("services/kinematics/core/a.cpp", "platform/bus/b.hpp"),
        ("services/kinematics/core/a.cpp", "accuracy/core/b.hpp"),
        ("services/kinematics/core/a.cpp", "thread"),
        ("services/kinematics/core/a.cpp", "grpcpp/grpcpp.h"),
        ("services/kinematics/core/a.cpp", "lambdajet/kinematics/v1/kinematics.pb.h"),
        ("services/kinematics/core/a.cpp", "ceres/ceres.h"),
        ("services/drive/core/a.cpp", "kinematics/core/b.hpp"),
        ("services/drive/core/a.cpp", "simulated_plant/core/b.hpp"),
        ("services/cell/core/a.cpp", "cell/rpc/b.hpp"),
        ("services/cell/rpc/a.cpp", "drive/core/b.hpp"),
        ("services/accuracy/rpc/a.cpp", "kinematics/rpc/b.hpp"),
        ("services/accuracy/rpc/a.cpp", "lambdajet/kinematics/v1/kinematics.pb.h"),
        ("services/accuracy/rpc/a.cpp", "lambdajet/drive/v1/state.h"),
        ("services/accuracy/bus/a.cpp", "lambdajet/accuracy/v1/accuracy.pb.h"),
        ("services/accuracy/rpc/a.cpp", "accuracy/main.cpp"),
        ("services/platform/bus/a.cpp", "drive/core/b.hpp"),
        ("services/platform/bus/a.cpp", "lambdajet/drive/v1/state.h"),
        ("services/trajectory/bus/a.cpp", "simulated_plant/plant_file/plant_file.hpp"),
        ("clients/cli/a.cpp", "kinematics/rpc/b.hpp"),
    ]
    ALLOWED = [
        ("services/foundation/machine/a.hpp", "foundation/geometry/b.hpp"),
        ("services/kinematics/core/a.cpp", "Eigen/Core"),
        ("services/kinematics/core/a.cpp", "cstdio"),
        ("services/kinematics/core/a.cpp", "foundation/motion/plan.hpp"),
        ("services/trajectory/core/a.cpp", "accuracy/core/b.hpp"),
        ("services/calibration/core/a.cpp", "ceres/ceres.h"),
        ("services/drive/main.cpp", "simulated_plant/core/b.hpp"),
        ("services/drive/main.cpp", "platform/house/house.hpp"),
        ("services/accuracy/bus/a.cpp", "lambdajet/drive/v1/state.h"),
        ("services/accuracy/rpc/a.cpp", "lambdajet/machine/v1/machine.pb.h"),
        ("services/cell/rpc/a.cpp", "lambdajet/trajectory/v1/trajectory.pb.h"),
        ("services/platform/rpc/a.cpp", "grpcpp/grpcpp.h"),
        ("clients/cli/a.cpp", "kinematics/core/b.hpp"),
    ]
    # Houses exist only where they have files.
    HOUSES = {f"services/{house}/core/there.hpp": GOOD for house in
              ("kinematics", "accuracy", "drive", "simulated_plant", "calibration", "trajectory", "cell")}

    def test_refuses_every_forbidden_arrow(self):
        for path, header in self.REFUSED:
            with self.subTest(path=path, header=header):
                found = Tree({**self.HOUSES, path: f'\n#include "{header}"\n'}).findings(check_layers.check)
                self.assertTrue(any(f.startswith(f"{path}:2:") for f in found), found)

    def test_allows_every_drawn_arrow(self):
        for path, header in self.ALLOWED:
            with self.subTest(path=path, header=header):
                self.assertEqual(Tree({**self.HOUSES, path: f'\n#include "{header}"\n'}).findings(check_layers.check), [])

    def test_refuses_a_loud_call_in_a_core(self):
        found = Tree({"services/cell/core/a.cpp": "void F() {\n  std::fprintf(stderr, \"x\");\n}\n"}).findings(check_layers.check)
        self.assertTrue(found and found[0].startswith("services/cell/core/a.cpp:2:"), found)

    def test_refuses_knowledge_of_the_truth(self):
        for path in ("services/drive/core/a.cpp", "services/calibration/bus/a.cpp", "clients/cli/a.cpp"):
            found = Tree({path: 'const char* kTopic = "plant/drive_truth";\n'}).findings(check_layers.check)
            self.assertEqual(len(found), 1, found)
        self.assertEqual(Tree({"services/inspection/bus/a.cpp": 'const char* kTopic = "plant/drive_truth";\n'})
                         .findings(check_layers.check), [])

    def test_refuses_a_new_room_of_the_foundation(self):
        self.assertEqual(len(Tree({"services/foundation/attic/a.hpp": GOOD}).findings(check_layers.check)), 1)


class Names(unittest.TestCase):
    def refuse(self, path, text, count=1):
        found = Tree({path: text}).findings(check_names.check)
        self.assertEqual(len(found), count, found)

    def test_refuses_names(self):
        self.refuse("services/cell/core/CamelCase.hpp", GOOD)
        self.refuse("services/cell/utils/a.hpp", GOOD)
        self.refuse("services/cell/core/helper.hpp", GOOD)
        self.refuse("services/cell/core/a.hpp", GOOD + "class JobManager {};\n")
        self.refuse("services/cell/core/a.hpp", GOOD + "struct Data {\n};\n")

    def test_refuses_numbers_without_unit(self):
        self.refuse("services/cell/core/a.hpp", GOOD + "struct Job {\n  double length = 0.0;\n  double time_s = 0.0;\n};\n")
        self.refuse("services/cell/core/a.hpp", GOOD + "struct Job {\n  double x_mm = 0.0, y = 0.0;\n};\n")
        self.refuse("proto/lambdajet/cell/v1/a.proto", "message A {\n  // x\n  double length = 1;\n  double x_mm = 2;\n}\n")
        self.refuse("idl/lambdajet/cell/v1/a.idl", "struct A {\n  double position[2];\n  double v_mm_per_s;\n};\n")

    def test_leaves_functions_and_comments_alone(self):
        self.refuse("services/cell/core/a.hpp",
                    GOOD + "struct Job {\n  // double length = 0.0;\n  double F() const {\n    double length = 1;\n    return length;\n  }\n};\n", 0)


class Headers(unittest.TestCase):
    def refuse(self, path, text, count=1):
        found = Tree({path: text}).findings(check_headers.check)
        self.assertEqual(len(found), count, found)

    def test_refuses_headers(self):
        self.refuse("services/cell/core/a.hpp", "#pragma once\n")
        self.refuse("services/cell/core/a.hpp", "// Solve it.\n#pragma once\n")
        self.refuse("services/cell/core/a.hpp", "// Solves it\n#pragma once\n")
        self.refuse("services/cell/core/a.hpp", "// Solves it.\n")
        self.refuse("services/cell/core/a.hpp", "// Solves it.\n#pragma once\n", 0)

    def test_refuses_a_field_without_comment(self):
        self.refuse("proto/a.proto", "message A {\n  // Why.\n  double x_mm = 1;\n  double y_mm = 2;\n}\n")
        self.refuse("proto/a.proto", "message A {\n  repeated string names = 1;  // In order.\n}\n", 0)


class Sizes(unittest.TestCase):
    def refuse(self, contents, count=1):
        found = Tree(contents).findings(check_sizes.check)
        self.assertEqual(len(found), count, found)

    def test_refuses_long_mains_and_functions(self):
        self.refuse({"services/cell/main.cpp": "//\n" * 41})
        self.refuse({"services/cell/main.cpp": "//\n" * 40}, 0)
        body = "  int a = 0;\n" * 60
        self.refuse({"services/cell/core/a.cpp": "namespace n {\nint F(int b) {\n" + body + "}\n}\n"})
        self.refuse({"services/cell/core/a.cpp": "class C {\n public:\n  C() : x_(1) {\n" + body + "  }\n};\n"})
        self.refuse({"services/cell/core/a.cpp": "namespace n {\nint F(int b) {\n" + "  int a = 0;\n" * 58 + "}\n}\n"}, 0)
        self.refuse({"services/cell/core/a.cpp": "namespace n {\n" + "int F() { return 0; }\n" * 100 + "}\n"}, 0)

    def test_refuses_long_readmes_and_dead_links(self):
        self.refuse({"services/README.md": "line\n" * 61})
        self.refuse({"services/README.md": "see [this](no/such/file.md)\n"})
        self.refuse({"services/README.md": "see [this](../a/b.md#part) and [that](https://example.org)\n", "a/b.md": "x\n"}, 0)


if __name__ == "__main__":
    unittest.main()
