#!/usr/bin/env python3
"""Tests of scripts/release: whatever is not ready is refused in words, and nothing is made."""

import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VERSION = "0.2.0"


def git(folder: Path, *arguments: str) -> str:
    """What Git prints."""
    who = ["-c", "user.name=test", "-c", "user.email=test@example.org"]
    return subprocess.run(["git", *who, *arguments], cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


class Refusals(unittest.TestCase):
    """Each in a clone of what is here, with a commit of what is not committed yet."""

    def setUp(self) -> None:
        """Makes the clone."""
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        for name in git(ROOT, "ls-files", "--cached", "--others", "--exclude-standard").splitlines():
            if (ROOT / name).exists():
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, self.folder / name)
        git(self.folder, "init", "--quiet")
        self.commit()

    def commit(self) -> None:
        """Commits what there is."""
        git(self.folder, "add", "--all")
        git(self.folder, "commit", "--quiet", "--allow-empty", "--message", "test")

    def change(self, file: str, old: str, new: str) -> None:
        """Changes a file and commits it."""
        path = self.folder / file
        text = path.read_text()
        self.assertIn(old, text)
        path.write_text(text.replace(old, new, 1))
        self.commit()

    def refused(self, *arguments: str, code: int = 1) -> str:
        """Why it is refused; nothing is there afterwards that was not there before."""
        done = subprocess.run(
            ["scripts/release", *arguments], cwd=self.folder, capture_output=True, text=True, check=False
        )
        self.assertEqual(done.returncode, code, done)
        self.assertNotIn("Traceback", done.stderr)
        self.assertFalse((self.folder / "dist").exists())
        self.assertFalse((self.folder / "target/release-work").exists())
        return done.stderr

    def test_versions(self) -> None:
        """What is no version."""
        for version in ("0.2", "v0.2.0", "0.2.0.1", "00.2.0", "0.2.0-rc1", ""):
            self.assertIn("is no version", self.refused(version))
        self.assertIn("VERSION", self.refused(code=2))

    def test_changes(self) -> None:
        """A file that Git does not know, and one that is changed."""
        (self.folder / "new.txt").write_text("new")
        self.assertIn("not committed: new.txt", self.refused(VERSION))
        (self.folder / "new.txt").unlink()
        (self.folder / "README.md").write_text("changed")
        self.assertIn("README.md", self.refused(VERSION))

    def test_tags(self) -> None:
        """A version is released once, and after those before it."""
        self.assertIn("is not that of this commit", self.refused(VERSION, "--tagged"))
        git(self.folder, "tag", f"v{VERSION}")
        self.assertIn("is there already", self.refused(VERSION))
        git(self.folder, "tag", "--delete", f"v{VERSION}")
        git(self.folder, "tag", "v0.10.0")
        self.assertIn("not above 0.10.0", self.refused(VERSION))

    def test_changelog(self) -> None:
        """What is new has to be said, with a date, above the earlier versions."""
        self.assertIn("has no section [0.3.0]", self.refused("0.3.0"))
        self.assertIn("not below 0.1.0: 0.2.0", self.refused("0.1.0"))
        self.change("CHANGELOG.md", f"## [{VERSION}] - ", f"## [{VERSION}] ")
        self.assertIn("needs its date", self.refused(VERSION))

    def test_manifests(self) -> None:
        """The version of the changelog is that of the crates."""
        self.change("CHANGELOG.md", f"## [{VERSION}]", f"## [0.2.1] - 2026-12-01\n\nMore.\n\n## [{VERSION}]")
        self.assertIn("has the version 0.2.0 in Cargo.toml, not 0.2.1", self.refused("0.2.1"))

    def test_a_place_that_is_taken(self) -> None:
        """Nothing is overwritten."""
        taken = self.folder / "target/taken"
        taken.mkdir(parents=True)
        self.assertIn("exists", self.refused(VERSION, "--out", str(taken)))
        self.assertEqual(list(taken.iterdir()), [])


if __name__ == "__main__":
    unittest.main()
