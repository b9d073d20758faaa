#!/usr/bin/env python3
"""The report of `tmcl test --junit` against the schema that CI servers use.

    python3 tests/clients/junit_schema.py target/debug/tmcl --image target/thumbv7em-none-eabi/release/tmcm1140

The schema is junit-10.xsd of Jenkins' xUnit plugin, which pytest validates its own reports with: it is taken from
pytest's source package, for which pip asks the package index. The report has cases that pass, that fail, that cannot be
read and that are left out, and characters that mean something in XML.
Ends with "N passed, M failed", and with exit code 1 if anything failed.
"""

import pathlib
import subprocess
import sys
import tarfile
import tempfile
import xml.etree.ElementTree

import xmlschema

from virtual_module import conclude, equal

PYTEST = "pytest==8.4.2"
SCHEMA = "/testing/example_scripts/junit-10.xsd"
EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"

MIXED = """\
for speed = 100, 500
== Slow <motors> & "others"
ROR 0, $speed
wait 1 s
expect velocity < 200
== Nobody understands this
jump > high
"""
LEFT_OUT = "== Left out\nnot on the image: it is <slow>\nMST 0\n"


def schema(folder):
    """The schema, from the source package."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:", PYTEST]
    subprocess.run(command, cwd=folder, check=True)
    (package,) = pathlib.Path(folder).glob("pytest-*.tar.gz")
    with tarfile.open(package) as archive:
        (name,) = [name for name in archive.getnames() if name.endswith(SCHEMA)]
        return xmlschema.XMLSchema(archive.extractfile(name).read().decode())


def main():
    program, _, image = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        rules = schema(folder)
        (folder / "mixed.txt").write_text(MIXED)
        (folder / "left_out.txt").write_text(LEFT_OUT)

        def run(*arguments):
            """The exit code, and the number of test cases, failures and skipped cases in the report, which is valid."""
            command = [program, "test", "--junit", "report.xml", *arguments]
            code = subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL).returncode
            rules.validate(str(folder / "report.xml"))
            cases = xml.etree.ElementTree.parse(folder / "report.xml").findall("testsuite/testcase")
            count = lambda tag: sum(case.find(tag) is not None for case in cases)
            return code, len(cases), count("failure"), count("skipped")

        code, cases, failures, skipped = run(EXAMPLES)
        equal("the examples pass", (code, failures, skipped), (0, 0, 0))
        equal("there are many of them", cases > 20, True)
        equal("each row is a case", run("mixed.txt"), (1, 3, 2, 0))
        equal("a case is left out", run("left_out.txt", "--image", image), (0, 1, 0, 1))
    conclude()


main()
