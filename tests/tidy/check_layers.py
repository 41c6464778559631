"""Who may include whom: the arrows of services/README.md, read from the includes; and who may know the simulated truth."""
import re

from source_tree import SOURCES, files, line_of, read, run, without_comments

FOUNDATION = ["contract", "geometry", "numerics", "machine", "motion"]  # each may include those before it
# What a house's core may include beside foundation and itself.
CORES = {
    "calibration": {"kinematics"},
    "accuracy": {"kinematics"},
    "trajectory": {"kinematics", "accuracy"},
    "simulated_plant": {"drive", "main_motion"},  # implements the hardware interfaces of both
}
# Quiet rooms: what they may take from outside the project. absl: news that is a Status.
QUIET_LIBRARIES = ("Eigen/", "absl/status/")
SOLVERS = {"calibration/core": ("ceres/",), "kinematics/optimisation": ("ceres/", "nlopt.hpp")}
LOUD_STD = {"thread", "mutex", "shared_mutex", "condition_variable", "future", "chrono", "fstream", "iostream", "ostream",
            "filesystem", "ctime", "stop_token", "semaphore"}
# <cstdio> is for snprintf, which formats a number into a message; what writes or reads is loud.
LOUD_CALL = re.compile(r"(?<![\w.>])(?:std::)?(printf|fprintf|fputs|puts|fopen|perror|scanf|getenv|system|rand|srand)\s*\(")
# Files that include what the rule forbids, and why that is right.
EXCEPTIONS = {
    "services/foundation/contract/expects.hpp": "prints where our own contract is broken, then aborts",
}
# Rooms outside core/ that compute and are as quiet as it.
QUIET_ROOMS = {"core", "optimisation"}
# Who may mention the simulated truth: the plants themselves, the node's main that introduces its plant, the judge.
TRUTH_PLACES = ("services/simulated_plant/", "services/inspection/", "services/drive/main.cpp", "services/main_motion/main.cpp",
                "services/drive/simulation/", "services/main_motion/simulation/")
TRUTH = re.compile(r'"plant/|lambdajet/plant/|simulated_plant/|plant_file')

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)


def place(path):
    """services/<house>/<room>/… as (house, room); a file beside the rooms is its own room."""
    parts = path.split("/")
    return parts[1], parts[2] if len(parts) > 3 else ""


def is_std(header):
    return "/" not in header and not header.endswith((".h", ".hpp"))


def quiet_fault(house, room, header):
    """Why a quiet room may not include that header, or None."""
    head, _, rest = header.partition("/")
    if head == "foundation":
        if house != "foundation":
            return None
        target = rest.split("/")[0]
        if target not in FOUNDATION or FOUNDATION.index(target) > FOUNDATION.index(room):
            return f"foundation/{room} stands below foundation/{target}"
        return None
    if header.startswith((f"{house}/core/", f"{house}/{room}/")):
        return None
    if rest.startswith(("core/", "optimisation/")) and head in CORES.get(house, set()):
        return None
    if header.startswith(QUIET_LIBRARIES) or header.startswith(SOLVERS.get(f"{house}/{room}", ("\0",))):
        return None
    if is_std(header):
        return f"a quiet room has no <{header}>" if header in LOUD_STD else None
    return "a quiet room includes only std, Eigen, absl/status, foundation and the cores named in services/README.md"


def door_fault(house, room, header, houses):
    """Why a door, a main or another loud room may not include that header, or None."""
    head, _, rest = header.partition("/")
    if rest.endswith("main.cpp") or header == "main.cpp":
        return "nobody includes a main"
    if head in houses and head not in (house, "foundation", "platform"):
        if rest.startswith(("core/", "optimisation/")) and head in CORES.get(house, set()):
            return None
        if head == "simulated_plant" and house in ("drive", "main_motion") and room in ("", "simulation"):
            return None  # the node's main introduces its plant
        if head == "link" and rest.startswith("wire/") and room == "bus":
            return None  # a sample of the link has one translation, for all who send or read it
        if head == "link" and house in ("drive", "main_motion"):
            return None  # what the doors of both machine modules share
        return f"the {house} house includes the {head} house; only cores named in services/README.md may be shared"
    if head == "lambdajet" and ".pb.h" in header and room == "bus":
        return "a bus door speaks IDL, not proto"
    if head == "lambdajet" and ".pb.h" not in header and room == "rpc":
        return "an rpc door speaks proto, not IDL"
    if head == "lambdajet" and ".pb.h" in header and rest.split("/")[0] not in (house, "type", "machine"):
        if house != "cell":  # the cell leads the other services over their own RPCs
            return f"the {house} house speaks the proto of {rest.split('/')[0]}"
    return None


def platform_fault(header, houses):
    head, _, rest = header.partition("/")
    if head in houses and head not in ("foundation", "platform"):
        return "platform includes a house"
    if head == "lambdajet" and not rest.startswith(("type/", "link/")):
        return "platform speaks a house's wire"
    return None


def check(root):
    houses = {path.split("/")[1] for path in files(root, "services", SOURCES) if path.count("/") >= 2}
    rooms = {path.split("/")[2] for path in files(root, "services/foundation", SOURCES)}
    for room in sorted(rooms - set(FOUNDATION)):
        yield f"services/foundation/{room}:1: foundation has the rooms {', '.join(FOUNDATION)}"
    for path in files(root, "services", SOURCES):
        house, room = place(path)
        text = read(root, path)
        for number, line in enumerate(text.split("\n"), 1):
            match = INCLUDE.match(line)
            if not match or path in EXCEPTIONS:
                continue
            header = match.group(1)
            if house == "platform":
                fault = platform_fault(header, houses)
            elif house == "foundation" or room in QUIET_ROOMS:
                fault = quiet_fault(house, room, header)
            else:
                fault = door_fault(house, room, header, houses)
            if fault:
                yield f"{path}:{number}: includes {header}: {fault}"
        if (house == "foundation" or room in QUIET_ROOMS) and path not in EXCEPTIONS and house != "platform":
            for match in LOUD_CALL.finditer(without_comments(text)):
                yield f"{path}:{line_of(text, match.start(1))}: calls {match.group(1)}: a quiet room neither reads nor writes"
    yield from check_truth(root)
    yield from check_clients(root)


def check_truth(root):
    for top in ("services", "clients"):
        for path in files(root, top, SOURCES):
            if path.startswith(TRUTH_PLACES):
                continue
            for number, line in enumerate(read(root, path).split("\n"), 1):
                if TRUTH.search(line) and not line.strip().startswith("//"):
                    yield f"{path}:{number}: knows of the simulated truth; only the plants and inspection may"


def check_clients(root):
    # The command line computes on files without any service, so it links cores; it opens no door of a house.
    for path in files(root, "clients", SOURCES):
        for number, line in enumerate(read(root, path).split("\n"), 1):
            match = INCLUDE.match(line)
            if match and re.match(r"\w+/(rpc|bus)/", match.group(1)) and not match.group(1).startswith("platform/rpc/"):
                yield f"{path}:{number}: includes {match.group(1)}: a client opens no door of a house"


if __name__ == "__main__":
    run("layers", check)
