"""Sizes: mains of 40 lines, functions of 60, READMEs of one page whose links lead somewhere."""
import os
import re

from source_tree import SOURCES, files, line_of, read, run, without_comments

MOST_MAIN_LINES = 40
MOST_FUNCTION_LINES = 60
MOST_README_LINES = 60
# "path: function" longer than that, and why it is right.
EXCEPTIONS = {
    "services/drive/core/drive_core.cpp: DriveCore::Act": "one switch, a case of a few lines for each action of the state table",
}

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


def functions(text):
    """(name, first line, lines) of every function body, by braces; a lambda belongs to the function around it."""
    stack = []  # (is_function, name, offset)
    start = 0   # where the current statement begins
    for at, c in enumerate(text):
        if c == "{":
            head = text[start:at]
            inside = any(entry[0] for entry in stack)
            name = re.search(r"([\w:~]+|operator\W{1,3})\s*\(", head)
            scope = re.search(r"\b(namespace|class|struct|enum|union)\b[^()]*$", head)
            is_function = not inside and bool(name) and not scope and "=" not in head.split("(")[0]
            stack.append((is_function, name.group(1) if name else "", at))
            start = at + 1
        elif c == "}":
            if stack:
                is_function, name, opened = stack.pop()
                if is_function:
                    yield name, line_of(text, opened), line_of(text, at) - line_of(text, opened) + 1
            start = at + 1
        elif c == ";":
            start = at + 1


def check_code(root):
    for top in ("services", "clients"):
        for path in files(root, top, SOURCES):
            text = read(root, path)
            bare = re.sub(r"(?m)^\s*#.*$", "", without_comments(text))
            if top == "services" and path.endswith("/main.cpp"):
                lines = [line for line in text.rstrip("\n").split("\n")]
                if len(lines) > MOST_MAIN_LINES:
                    yield f"{path}:1: has {len(lines)} lines; a main is a list of introductions of at most {MOST_MAIN_LINES}"
            for name, line, size in functions(bare):
                if size > MOST_FUNCTION_LINES and f"{path}: {name}" not in EXCEPTIONS:
                    yield f"{path}:{line}: {name} has {size} lines; right is at most {MOST_FUNCTION_LINES}"


def check_readmes(root):
    for path in files(root, ".", ("README.md",)):
        path = os.path.normpath(path)
        text = read(root, path)
        lines = text.rstrip("\n").split("\n")
        if len(lines) > MOST_README_LINES:
            yield f"{path}:1: has {len(lines)} lines; a README is one page, at most {MOST_README_LINES}"
        for number, line in enumerate(lines, 1):
            for target in LINK.findall(line):
                if re.match(r"[a-z]+:", target):
                    continue
                if not os.path.exists(os.path.join(root, os.path.dirname(path), target)):
                    yield f"{path}:{number}: links to {target}, which is not there"


def check(root):
    yield from check_code(root)
    yield from check_readmes(root)


if __name__ == "__main__":
    run("sizes", check)
