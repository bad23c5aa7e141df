"""The documentation site builds without a warning, and shows what it is said to show."""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

import vinesexp
from vinesexp.cli import COMMANDS

pytestmark = pytest.mark.long

REPOSITORY = Path(__file__).resolve().parents[1]


def hook(name: str):
    """A module of docs/hooks, which is no package."""
    spec = importlib.util.spec_from_file_location(name, REPOSITORY / f"docs/hooks/{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    pytest.importorskip("material", reason="the site's packages are an extra: docs")
    pytest.importorskip("mkdocstrings")
    folder = tmp_path_factory.mktemp("site")
    built = build(REPOSITORY / "mkdocs.yml", folder)
    assert built.returncode == 0, built.stderr
    return folder


def build(config: Path, folder: Path) -> "subprocess.CompletedProcess[str]":
    """The site, strictly. With --quiet mkdocs counts no warnings, and a broken link ends with 0."""
    return subprocess.run(
        [
            *(sys.executable, "-m", "mkdocs", "build", "--strict"),
            *("--config-file", str(config), "--site-dir", str(folder)),
        ],
        cwd=config.parent,
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_broken_link_does_not_pass(tmp_path):
    """The same command as for the site, so that the check of the documentation can fail."""
    pytest.importorskip("mkdocs", reason="the site's packages are an extra: docs")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/index.md").write_text("[there](nowhere.md)\n", encoding="utf-8")
    (tmp_path / "mkdocs.yml").write_text("site_name: One page\n", encoding="utf-8")
    broken = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert broken.returncode != 0
    assert "nowhere.md" in broken.stderr


def page(site: Path, name: str) -> str:
    return (site / name / "index.html").read_text(encoding="utf-8")


def test_every_command_and_every_public_name_has_its_place(site):
    commands = page(site, "reference/commands")
    for name in COMMANDS:
        assert f"vinesexp {name}</h2>" in re.sub(r"<a [^>]*>[^<]*</a>", "", commands), name
    reference = page(site, "reference/python")
    for name in set(vinesexp.__all__) - {"__version__"}:
        assert re.search(rf'id="vinesexp\.[\w.]*\b{name}"', reference), name


def test_the_theory_has_rendered_equations_and_the_gallery_its_figures(site):
    theory = page(site, "theory")
    assert theory.count("<math>") > 50
    assert "<msqrt>" in theory
    gallery = page(site, "gallery")
    scripts = sorted((REPOSITORY / "docs/gallery").glob("*.py"))
    assert len(scripts) >= 10
    for script in scripts:
        assert f'src="{script.stem}.png"' in gallery
        assert (site / f"gallery/{script.stem}.png").stat().st_size > 10_000


def test_the_page_of_all_benchmarks_has_every_number():
    pytest.importorskip("mkdocs")
    found = hook("glance").page()
    rows = [line for line in found.splitlines() if line.startswith("| ")][1:]
    assert len(rows) > 15
    assert not [row for row in rows if "| -" in row or "- " in row.split("|")[4][:3]]


def test_no_block_of_code_is_left_as_text(site):
    for path in site.rglob("*.html"):
        assert "```" not in path.read_text(encoding="utf-8"), path.relative_to(site)


def test_no_page_asks_the_network_for_anything(site):
    for path in site.rglob("*.html"):
        text = path.read_text(encoding="utf-8")
        fetched = re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"?(https?://[^\" >]+)", text)
        assert fetched == [], path.relative_to(site)


def declared(styles: str, selector: str, name: str) -> str:
    """What the last rule for just this selector sets, variables resolved among `styles`."""
    found = ""
    rules = re.sub(r"/\*.*?\*/", "", styles, flags=re.DOTALL)
    for selectors, body in re.findall(r"([^{}]+)\{([^{}]*)\}", rules):
        if selector in [one.strip() for one in selectors.split(",")]:
            for value in re.findall(rf"(?:^|;|\s){re.escape(name)}:\s*([^;]+)", body):
                found = value.strip()
    return found


def luminance(colour: Sequence[float]) -> float:
    """Relative luminance of the contrast that WCAG 2 defines, of red, green, blue from 0 to 1."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
    return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def contrast_of_tabs(styles: str, primary: str) -> float:
    """Of the words of the tabs on their bar, as the opacity of the words leaves it."""

    def colour(name: str) -> list[float]:
        variable = declared(styles, ".md-tabs", name).removeprefix("var(").removesuffix(")")
        text = declared(styles, f"[data-md-color-primary={primary}]", variable).lstrip("#")
        text = text if len(text) == 6 else "".join(2 * one for one in text)
        return [int(text[k : k + 2], 16) / 255.0 for k in (0, 2, 4)]

    opacity = float(declared(styles, ".md-tabs__link", "opacity"))
    bar = colour("background-color")
    words = [opacity * w + (1.0 - opacity) * b for w, b in zip(colour("color"), bar, strict=True)]
    light, dark = sorted((luminance(words), luminance(bar)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_the_tabs_of_the_site_can_be_read():
    """At least 4.5 to 1, what WCAG 2 asks of small text, in the light scheme and in the dark."""
    material = pytest.importorskip("material", reason="the site's packages are an extra: docs")
    config = yaml.safe_load((REPOSITORY / "mkdocs.yml").read_text(encoding="utf-8"))
    own = [REPOSITORY / "docs" / name for name in config["extra_css"]]
    of_theme = Path(material.__file__).parent / "templates/assets/stylesheets"
    sheets = [*sorted(of_theme.glob("*.css")), *own]
    styles = "".join(sheet.read_text(encoding="utf-8") for sheet in sheets)
    assert {palette["scheme"] for palette in config["theme"]["palette"]} == {"default", "slate"}
    for palette in config["theme"]["palette"]:
        assert contrast_of_tabs(styles, palette["primary"].replace(" ", "-")) >= 4.5


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("A_1 = 2 Gamma/sqrt(S)", ["<msub><mi>A</mi><mn>1</mn></msub>", "Γ", "<msqrt>"]),
        ("x'+ = -r", ["<msup><mo>′</mo><mo>+</mo></msup>", "−"]),
        ("k1 <= pi^2", ["<msub><mi>k</mi><mn>1</mn></msub>", "≤", "<msup><mi>π</mi><mn>2</mn>"]),
    ],
)
def test_plain_text_becomes_mathematics(text, parts):
    found = hook("equations").mathml(text)
    assert all(part in found for part in parts), found


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("b_c at eps and k1, pi^2", "b<sub>c</sub> at ε and k<sub>1</sub>, π<sup>2</sup>"),
        ("`b_c` in [text](b_c.md)", "`b_c` in [text](b_c.md)"),
        ("frequency_hz, a beta, r.csv", "frequency_hz, a β, r.csv"),
        ("```\nf0 = 8\n```\nf0", "```\nf0 = 8\n```\nf<sub>0</sub>"),
        ("    b_c\n# b_c", "    b_c\n# b_c"),
    ],
)
def test_symbols_in_text_are_those_of_the_equations(text, written):
    assert hook("equations").in_text(text) == written


def test_only_indented_blocks_after_an_empty_line_are_equations():
    found = hook("equations").rendered("words\n\n    A = 1   (2)\n\n- a\n    b\n")
    assert found.count("<math>") == 1
    assert '<span class="number">(2)</span>' in found
    assert "- a\n    b" in found


def test_the_picture_of_the_readme_is_of_the_shipped_campaign():
    """Made anew by python -m benchmarks.readme_figure, after a run of the twin."""
    from benchmarks.readme_figure import PICTURE, digest

    assert f"data/twin {digest(REPOSITORY / 'data/twin')}".encode() in PICTURE.read_bytes()


def test_the_picture_of_the_readme_shows_what_is_found_today(tmp_path):
    """One of its records, made and analysed anew: the digest alone sees no change of the code."""
    from benchmarks.readme_figure import carried

    from vinesexp.laboratory.experiment import perform
    from vinesexp.laboratory.scene import load_scene, raw_file, truth_file
    from vinesexp.pipeline import analyse_record
    from vinesexp.records.campaign.load import load_campaign
    from vinesexp.records.stored.result_paths import ResultPaths

    campaign, record = tmp_path / "twin", "periodic_025_b45"
    shutil.copytree(REPOSITORY / "data/twin", campaign, ignore=lambda *_: ["raw", "truth"])
    scene = load_scene(campaign / "scene.yaml")
    (test,) = (t for tests in scene.groups.values() for t in tests if t.record == record)
    for path in (raw_file(test), truth_file(test)):
        (campaign / path).parent.mkdir()
    perform(scene, test, raw=campaign / raw_file(test), truth=campaign / truth_file(test))
    read = load_campaign(campaign)
    paths = ResultPaths(tmp_path)
    analyse_record(read, read.record(record), paths=paths)
    (found,) = json.loads(paths.regime(record).read_text(encoding="utf-8"))["regime"]
    now = [1e3 * found["amplitude_mean_m"], 1e3 * found["amplitude_max_m"]]
    assert carried()[record] == pytest.approx(now, rel=1e-3)
    assert set(carried()) == {r.id for r in read.records if r.id.startswith("periodic_")}


def test_the_citation_names_the_version_that_is_installed():
    """That of the last release; between releases the package counts on from it."""
    from importlib.metadata import version

    from packaging.version import Version

    cited = Version(str(yaml.safe_load((REPOSITORY / "CITATION.cff").read_text())["version"]))
    installed = Version(version("vinesexp"))
    newest = re.search(
        r"^## ([\d.]+)", (REPOSITORY / "CHANGELOG.md").read_text(), flags=re.MULTILINE
    )
    assert newest is not None
    assert cited == Version(newest[1])
    if installed.is_devrelease:
        counted = (installed.major, installed.minor, installed.micro)
        assert counted in (cited.release, (cited.major, cited.minor, cited.micro + 1))
    else:
        assert installed == cited
