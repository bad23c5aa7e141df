"""Pages of docs/benchmarks and the code that they measured."""

from benchmarks.pages import ROOT, Age, age_of, benchmarks_of, code_measured, code_of


def test_the_code_of_a_benchmark_is_followed_through_benchmarks_and_package():
    code = code_of(["benchmarks.robustness"])
    assert {"benchmarks/robustness/page.py", "benchmarks/robustness/__main__.py"} <= set(code)
    assert "src/vinesexp/identification/whole_campaign.py" in code
    assert "benchmarks/watching.py" not in code
    assert all((ROOT / name).is_file() for name in code)


def test_every_benchmark_that_a_page_names_is_there():
    pages = sorted((ROOT / "docs/benchmarks").glob("*.md"))
    named = {name for page in pages for name in benchmarks_of(page.read_text(encoding="utf-8"))}
    assert len(named) > 10
    for name in named:
        assert code_of([name]), name


def test_a_line_says_how_far_a_page_is_behind_and_what_makes_it_anew():
    words = Age("plan", "2026-01-02", ("benchmarks.plan",), 90, 3, 41).words
    assert "3 of  90 modules,     41 lines" in words
    assert words.endswith("python -m benchmarks.plan")


def test_the_age_of_a_page_is_that_of_the_code_it_names(tmp_path):
    page = tmp_path / "plan.md"  # no commit wrote it
    made = f"Made by `python -m benchmarks.plan` with the code of {code_measured()}."
    page.write_text(made, encoding="utf-8")
    age = age_of(page)
    assert (age.page, age.commands) == ("plan", ("benchmarks.plan",))
    assert age.modules > 50
    assert age.changed <= age.modules
    assert len(age.written) == len("2026-01-02")
