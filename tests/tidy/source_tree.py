"""Reads the project's files for the tidy checks; a finding is "path:line: what is wrong and what is right"."""
import os
import re
import sys

SOURCES = (".hpp", ".cpp")
SKIPPED = {"build", "node_modules", "__pycache__", ".git", ".cache"}


def files(root, top, endings):
    """Paths below root/top, relative to root, that end as asked; generated and hidden folders are not entered."""
    for folder, folders, names in os.walk(os.path.join(root, top)):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith((".", "build-")))
        for name in sorted(names):
            if name.endswith(endings):
                yield os.path.relpath(os.path.join(folder, name), root)


def read(root, path):
    with open(os.path.join(root, path), encoding="utf-8") as file:
        return file.read()


def without_comments(text):
    """C++ or IDL or proto text with comments, and the insides of literals, blanked; line numbers stay."""
    pattern = re.compile(r'//[^\n]*|/\*.*?\*/|R"\w*\(.*?\)\w*"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)

    def blank(match):
        found = match.group(0)
        if found[0] in "\"'":
            return found[0] + " " * (len(found) - 2) + found[-1]
        return re.sub(r"[^\n]", " ", found)

    return pattern.sub(blank, text)


def line_of(text, at):
    return text.count("\n", 0, at) + 1


def run(name, check):
    """The command line of a check: a root folder, or the project's own."""
    root = sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
    findings = list(check(os.path.abspath(root)))
    for finding in findings:
        print(finding)
    print(f"{name}: {len(findings)} findings")
    sys.exit(1 if findings else 0)
