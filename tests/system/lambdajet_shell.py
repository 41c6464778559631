"""The command line against a live cell: what it says, its exit code, and that it never fails in silence."""

import json
import subprocess

DONE, REFUSED, UNREACHABLE, WRONG_STATE = 0, 4, 3, 6


class Lambdajet:
    def __init__(self, test, build, announce_folder):
        self.test = test
        self.program = build / "bin" / "lambdajet"
        self.flags = ["--announce-dir", str(announce_folder)]

    def run(self, *words, code=DONE, answered=False):
        """Standard output; fails the test unless the exit code is one of those expected. `answered`: a refusal that is an answer."""
        done = subprocess.run([str(self.program), *self.flags, *map(str, words)], stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=60, check=False)
        said, trouble = done.stdout.decode(), done.stderr.decode()
        expected = code if isinstance(code, tuple) else (code,)
        self.test.assertIn(done.returncode, expected, f"{words}: {said}{trouble}")
        if answered:
            return said
        if done.returncode in (REFUSED, UNREACHABLE):
            self.test.assertEqual(said, "", f"{words} failed and still answered")
            self.test.assertNotEqual(trouble, "", f"{words} failed in silence")
        return said if done.returncode not in (REFUSED, UNREACHABLE) else trouble

    def ask(self, *words, code=DONE):
        """What the verb says with --json, after it has said the same in words: (words, value)."""
        people = self.run(*words, code=code)
        self.test.assertNotEqual(people.strip(), "", f"{words} has nothing to say to people")
        return people, self.ask_json(*words, code=code)

    def ask_json(self, *words, code=DONE, answered=False):
        lines = self.run("--json", *words, code=code, answered=answered).strip().splitlines()
        self.test.assertTrue(lines, f"{words} has nothing to say with --json")
        return [json.loads(line) for line in lines][-1]
