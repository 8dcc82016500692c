"""Commands that documents show: the scripts, sub-commands and options in them exist.

A command is a line of a shell block, or quoted words with an option, whose first word is a script of the repository, a
tool or an application. An option exists if the sources of its program contain it. Nothing is run here:
test/tools/commands_test.py runs the tools, test/install the programs of users.
"""
import re

SOURCES = (".py", ".cpp", ".h")
SHELL = {"", "sh"}
QUOTED = re.compile(r"`([^`]+ --?\w[^`]*)`")
OPTION = re.compile(r"(?<![\w-])--([a-z][\w-]*)")
# A word that a script takes as it stands: "kernels" in `tools/bench kernels --quick`.
SUBCOMMAND = re.compile(r"[a-z][a-z_]+$")

# Programs whose options are read by sources outside of the file that a command names.
FOLDERS = {
    "opt": ["tools/opt"],
    "tune": ["tools/tuning"],
    "gpu_check": ["tools/device"],
    "tools/gpu_check": ["tools/gpu_check", "tools/device"],
    "tools/bench": ["tools/bench", "bench", "apps/common"],
    "tools/demo": ["tools/demo", "apps"],
    "tools/fuzz": ["tools/fuzz", "test/support", "test/property", "test/gradient"],
    "tools/api_table": ["tools/api_table"],
}


def commands_in(page):
    """(line number, words) of each command that a page shows."""
    commands, language = [], None
    for number, line in enumerate(page.splitlines(), 1):
        if line.startswith("```"):
            language = line[3:].strip() if language is None else None
        elif language is None:
            commands += [(number, quoted.split()) for quoted in QUOTED.findall(line)]
        elif language in SHELL:
            words = re.sub(r"(^|\s)#.*", "", line).split()
            if line.startswith(" ") and commands:
                commands[-1][1].extend(words)
            elif words:
                commands.append((number, words))
    return commands


class Programs:
    """The programs of a repository, and the text in which their options stand."""

    def __init__(self, root):
        self.root = root
        self.apps = {path.parent.name for path in (root / "apps").glob("*/main.cpp")}
        self.texts = {}

    def find(self, words):
        """The name of the program that a command runs and its arguments, or None if it is none of the repository's."""
        for at, word in enumerate(words):
            name = re.sub(r"^(\./|out/build/\w+/tools/)", "", word)
            if name in FOLDERS or name in self.apps or "/" in name and (self.root / name).is_file():
                return name, words[at + 1:]
            if at == 0 and not re.match(r"\w+=|python3$|torchrun$", word):
                return None
        return None

    def text_of(self, name):
        if name not in self.texts:
            places = FOLDERS.get(name, [f"apps/{name}", "apps/common"] if name in self.apps
                                 else [str((self.root / name).parent.relative_to(self.root))])
            files = [file for place in map(self.root.joinpath, places)
                     for file in ([place] if place.is_file() else sorted(place.rglob("*")))
                     if file.suffix in SOURCES or file == place]
            self.texts[name] = "\n".join(file.read_text(errors="replace") for file in files)
        return self.texts[name]

    def has_option(self, name, option):
        return re.search(rf"(?:--|\"){option}(?![\w-])", self.text_of(name)) is not None

    def has_subcommand(self, name, word):
        known = (self.root / name).read_text() + (self.root / "tools/packages.list").read_text()
        known += (self.root / "CMakePresets.json").read_text()
        return (self.root / "apps" / word).is_dir() or re.search(rf"\b{word}\b", known) is not None


def findings_in_commands(page, programs):
    """(line number, finding) for each part of a shown command that does not exist."""
    for number, words in commands_in(page):
        if words and re.match(r"(\./)?tools/\w+$", words[0]) and not programs.find(words):
            yield number, f"there is no {words[0]}"
        found = programs.find(words)
        if not found:
            continue
        name, arguments = found
        for word in subcommands(arguments) if name.startswith("tools/") else []:
            if not programs.has_subcommand(name, word):
                yield number, f"{name} has no \"{word}\""
        for option in OPTION.findall(" ".join(arguments)):
            if not programs.has_option(name, option):
                yield number, f"{name} has no option --{option}"


def subcommands(arguments):
    """The words before the first option or placeholder."""
    for word in arguments:
        if not SUBCOMMAND.match(word):
            return
        yield word
