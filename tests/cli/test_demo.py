"""``knittest demo``: the table of the README, and a report that explains each part of itself."""

import re
from pathlib import Path

import pytest
from html_page import HtmlPage

from knittest.cli.main import run, summaries
from knittest.report_page.guide import COMMANDS, GUIDE, NEXT, TITLE
from knittest.report_page.page import write_reports

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def test_the_demo_prints_the_table_of_the_readme_and_explains_each_part_of_its_report(tmp_path, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    monkeypatch.setenv("CI", "1")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.chdir(tmp_path)
    assert run(["demo"]) == 0 and opened == []
    (shown,) = re.findall(r"^```\n(warp, macro: .*?)^```$", README, re.M | re.S)
    printed = capsys.readouterr().out
    assert shown == printed

    page = HtmlPage(tmp_path / "runs/demo/report.html")
    words = page.text()
    assert [text for text in GUIDE.values() if words.count(text) != 1] == []
    sections = page.all("section")
    assert page.text(sections[0]).startswith(TITLE) and page.text(sections[-1]).startswith(NEXT)
    for kind in GUIDE:
        anchor = kind.replace("run", "run-1", 1)
        assert GUIDE[kind] in page.text(page.section(anchor))
    commands = [row[0] for row in page.tables(sections[-1])["Commands to try"][1:]]
    assert len(commands) == len(COMMANDS) and "knittest view runs/demo/meso" in commands
    assert {command.split()[1] for command in commands} <= {*summaries(), "--help"}

    write_reports([tmp_path / "runs/demo"], None)
    assert TITLE not in HtmlPage(tmp_path / "runs/demo/report.html").text(), "reports of others explain nothing"


@pytest.mark.parametrize(
    ("words", "ci", "opens"), [([], None, True), (["--no-open"], None, False), ([], "true", False)]
)
def test_the_demo_opens_its_report_for_a_person(tmp_path, monkeypatch, words, ci, opens):
    asked = []
    monkeypatch.setattr(
        "knittest.studies.command.run_command", lambda runs, options: asked.append((runs, options)) or 0
    )
    monkeypatch.setenv("CI", ci) if ci else monkeypatch.delenv("CI", raising=False)
    monkeypatch.chdir(tmp_path)
    assert run(["demo", "--variant", "1", *words]) == 0
    ((runs, options),) = asked
    assert options.open_page is opens and options.explained
    assert [(one.fabric.name, one.model.scale) for one in runs] == [("pham2019-v1", "macro"), ("pham2019-v1", "meso")]
