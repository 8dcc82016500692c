"""The documentation site: it builds without a warning, its links lead somewhere, every public name has a signature in
its reference, and a browser shows its pages.

    site_test.py STUBS OUTPUT      STUBS holds retrograde/_retrograde.pyi

Exit status 77 where a package of the groups "docs" or "test" is missing.
"""
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools/lib"))
sys.dont_write_bytecode = True

MODULES = ["sphinx", "myst_parser", "breathe", "sphinx_copybutton", "furo", "PIL"]
PROGRAMS = ["doxygen", "chromium"]
WIDTH, HEIGHT = 1400, 1600


def missing_packages():
    return ([name for name in MODULES if not importlib.util.find_spec(name)]
            + [name for name in PROGRAMS if not shutil.which(name)])


class Site(unittest.TestCase):
    stubs, output = None, None  # of the command line

    @classmethod
    def setUpClass(cls):
        from pages.links import read_pages
        command = [ROOT / "tools/docs", "--stubs", cls.stubs, "--output", cls.output]
        cls.build = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        cls.pages = read_pages(cls.output)

    def test_builds_without_warnings(self):
        self.assertEqual(self.build.returncode, 0, self.build.stdout[-4000:])

    def test_has_no_broken_link(self):
        from pages.links import broken_links
        self.assertEqual(list(broken_links(self.pages)), [])

    def test_has_a_signature_of_every_cpp_name(self):
        from pages.signatures import unsigned_cpp_names
        self.assertEqual(list(unsigned_cpp_names(ROOT, self.output, self.pages)), [])

    def test_has_a_signature_of_every_python_name(self):
        from pages.signatures import unsigned_python_names
        self.assertEqual(unsigned_python_names(ROOT, self.stubs, self.output, self.pages), [])

    def test_is_searched(self):
        index = (self.output / "searchindex.js").read_text()
        for word in ("propagate_adjoints", "compute_at", "bilateral_slice"):
            self.assertIn(word, index)

    # ---- in a browser ----

    def browse(self, page, *options):
        with tempfile.TemporaryDirectory() as profile:
            command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                       f"--user-data-dir={profile}", "--virtual-time-budget=5000", *options, f"file://{self.output / page}"]
            return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout

    def check_page(self, page, title, colours):
        """Its title, and a screenshot in which there are that many colours. The picture stays beside the site."""
        self.assertIn(f"<title>{title}", self.browse(page, "--dump-dom"))
        shot = self.output.parent / "screenshots" / f"{Path(page).stem}.png"
        shot.parent.mkdir(exist_ok=True)
        self.browse(page, f"--window-size={WIDTH},{HEIGHT}", f"--screenshot={shot}")
        self.check_picture(shot, colours)

    def check_picture(self, path, colours):
        from PIL import Image
        with Image.open(path) as image:
            self.assertEqual(image.size, (WIDTH, HEIGHT))
            counts = image.convert("RGB").getcolors(maxcolors=WIDTH * HEIGHT)
        self.assertGreater(len(counts), colours)
        self.assertLess(max(count for count, _ in counts), 0.95 * WIDTH * HEIGHT, "the page is blank")

    def test_shows_the_home_page_with_its_photograph(self):
        self.check_page("index.html", "Retrograde", colours=5000)

    def test_shows_a_page_of_the_reference(self):
        self.check_page("reference/cpp/frontend_language_func.html", "func.h", colours=100)

    def test_shows_the_gallery_with_its_pictures(self):
        self.check_page("gallery.html", "Gallery", colours=10000)


if __name__ == "__main__":
    if missing_packages():
        print("not installed:", *missing_packages(), "(tools/install_packages docs test)")
        sys.exit(77)
    Site.stubs, Site.output = (Path(argument).resolve() for argument in sys.argv[1:3])
    unittest.main(argv=sys.argv[:1], verbosity=2)
