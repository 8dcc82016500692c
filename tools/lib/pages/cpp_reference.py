"""The reference of the C++ library: Doxygen's XML of the public headers, as Breathe reads it.

Doxygen finds the signatures. Which names are public, in which order and under which captions, is as the headers have it
and tools/api_table reads it: the XML written here holds these names and no others, sorted by line.
"""
import re
import subprocess
import xml.etree.ElementTree as ET

from api.headers import HIDDEN_SPACES

DOXYFILE = """
INPUT = headers
STRIP_FROM_PATH = headers
RECURSIVE = YES
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_OUTPUT = doxygen
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
AUTOLINK_SUPPORT = NO
MACRO_EXPANSION = YES
INCLUDE_PATH = {compiler}
PREDEFINED = HALIDE_ALWAYS_INLINE=
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_AS_ERROR = YES
"""
USING = re.compile(r"\s*using\s+([\w:]+)::(\w+)\s*;")


def run_doxygen(root, work, headers):
    for header in headers:
        path = work / "headers" / header.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(header.text())
    (work / "Doxyfile").write_text(DOXYFILE.format(compiler=root / "compiler"))
    subprocess.run(["doxygen", "Doxyfile"], cwd=work, check=True)
    return DoxygenOutput(work / "doxygen")


def without_arguments(name):
    """Template arguments away, and spaces: GeneratorOutput< T[] >::size => GeneratorOutput::size."""
    while True:
        shorter = re.sub(r"(?<=\w)\s*<[^<>]*>", "", name)
        if shorter == name:
            return re.sub(r"\s+(?=[&*])", "", name)
        name = shorter


def qualify_conversions(compound):
    """Doxygen takes conversions to `Space::Name` for members of Space, or does not qualify them."""
    for member in compound.iter("memberdef"):
        if member.findtext("name").startswith("operator "):
            for wrong in member.findall("qualifiedname"):
                member.remove(wrong)
            name = f"{compound.findtext('compoundname')}::{member.findtext('name')}"
            ET.SubElement(member, "qualifiedname").text = name


class DoxygenOutput:
    """The compounds of Doxygen's XML, each with its names as users write them."""

    def __init__(self, folder):
        files = [path for path in sorted(folder.glob("*.xml")) if path.stem not in ("index", "Doxyfile")]
        compounds = [ET.parse(path).getroot().find("compounddef") for path in files]
        self.namespaces = [c for c in compounds if c.get("kind") == "namespace"]
        self.classes = [c for c in compounds if c.get("kind") in ("class", "struct")]
        self.spaces = {c.findtext("compoundname") for c in self.namespaces}
        for compound in self.namespaces + self.classes:
            qualify_conversions(compound)

    def space_of(self, qualified):
        return max((space for space in self.spaces if qualified.startswith(space + "::")), key=len, default="")

    def name_of(self, qualified):
        """Without its namespace, as in tools/api_table; empty in a hidden one."""
        space = self.space_of(qualified)
        return "" if HIDDEN_SPACES & set(space.split("::")) else qualified.removeprefix(space + "::")

    def free_members(self):
        return [member for space in self.namespaces for member in space.iter("memberdef")]


class Reference:
    """Chooses among what Doxygen found and writes it for Breathe: classes, and a group for every caption."""

    def __init__(self, headers, doxygen, folder):
        self.headers = {header.path: header for header in headers}
        self.public = {header.path: {re.sub(r"\s+", "", without_arguments(name.full)) for name in header.names}
                       for header in headers}
        self.doxygen, self.folder = doxygen, folder
        self.index = ET.Element("doxygenindex", version="1.9.4")

    def write(self):
        """Gives what the page of each header shows: its classes, and pairs of a caption and a group."""
        self.folder.mkdir(parents=True, exist_ok=True)
        pages = {path: (self.write_classes(header), self.write_groups(header))
                 for path, header in self.headers.items()}
        ET.ElementTree(self.index).write(self.folder / "index.xml")
        return pages

    # ---- choosing ----

    def header_of(self, element):
        return self.headers.get(element.find("location").get("file"))

    def line_of(self, element):
        line = int(element.find("location").get("line"))
        return self.header_of(element).original_line[line - 1]

    def is_public(self, element, qualified):
        header, name = self.header_of(element), self.doxygen.name_of(qualified)
        return (header is not None and element.get("prot") in ("public", None)
                and re.sub(r"\s+", "", without_arguments(name)) in self.public[header.path])

    def public_members(self, members):
        return [m for m in members if self.is_public(m, m.findtext("qualifiedname"))]

    def by_caption(self, header, members):
        """Sorted by line; neighbours under one caption together."""
        groups = []
        for member in sorted(members, key=self.line_of):
            caption = header.section_of(self.line_of(member))
            if not groups or groups[-1][0] != caption:
                groups.append((caption, []))
            groups[-1][1].append(member)
        return groups

    # ---- classes ----

    def write_classes(self, header):
        found = [c for c in self.doxygen.classes
                 if self.header_of(c) is header and self.is_public(c, c.findtext("compoundname"))]
        specialised = [c for c in found if "<" in c.findtext("compoundname")]
        found = [c for c in found if c not in specialised]
        outer = [c for c in found if "::" not in self.doxygen.name_of(c.findtext("compoundname"))]
        for compound in found:
            self.write_class(header, compound, found, specialised)
        return [(c.get("kind"), c.findtext("compoundname")) for c in sorted(outer, key=self.line_of)]

    def write_class(self, header, compound, public, specialised):
        """With the members of its specialisations: users see one template, and Sphinx knows no constrained ones."""
        name = compound.findtext("compoundname")
        parts = [compound] + [c for c in specialised if without_arguments(c.findtext("compoundname")) == name]
        members = without_repetitions(self.public_members(m for part in parts for m in part.iter("memberdef")))
        inner = {c.get("id") for c in public}
        for part in list(compound):
            is_hidden = part.tag == "innerclass" and part.get("refid") not in inner
            if is_hidden or part.tag in ("sectiondef", "includes", "derivedcompoundref"):
                compound.remove(part)
        for caption, group in self.by_caption(header, members):
            compound.append(section(caption or "Members", group))
        compound.find("compoundname").text = name.removeprefix("retrograde::")
        self.write_compound(compound, members)

    # ---- what belongs to no class ----

    def write_groups(self, header):
        members = [m for m in self.public_members(self.doxygen.free_members()) if self.header_of(m) is header]
        members += self.brought_in(header)
        captions = self.by_caption(header, members)
        return [(caption, self.write_group(f"{header.page}_{number}", group))
                for number, (caption, group) in enumerate(captions)]

    def brought_in(self, header):
        """By a using-declaration from a hidden namespace: using ir::likely."""
        names = [match for match in map(USING.match, header.reader.lines) if match]
        wanted = {f"retrograde::{match.group(1)}::{match.group(2)}" for match in names}
        return [m for m in self.doxygen.free_members() if m.findtext("qualifiedname") in wanted
                and not self.doxygen.name_of(m.findtext("qualifiedname"))]

    def write_group(self, name, members):
        compound = ET.Element("compounddef", id="group__" + name, kind="group")
        ET.SubElement(compound, "compoundname").text = name
        compound.append(section("", members))
        for member in members:
            qualified = member.findtext("qualifiedname")
            is_shown = self.doxygen.name_of(qualified)
            member.find("name").text = qualified.removeprefix("retrograde::") if is_shown else member.findtext("name")
        self.write_compound(compound, members)
        return name

    # ---- files ----

    def write_compound(self, compound, members):
        for member in members:
            member.set("inline", "no")  # where a function is defined is not the reader's business
            show_constraint(member)
        entry = ET.SubElement(self.index, "compound", refid=compound.get("id"), kind=compound.get("kind"))
        ET.SubElement(entry, "name").text = compound.findtext("compoundname")
        root = ET.Element("doxygen", version="1.9.4")
        root.append(compound)
        ET.ElementTree(root).write(self.folder / f"{compound.get('id')}.xml")


def section(caption, members):
    element = ET.Element("sectiondef", kind="user-defined" if caption else "func")
    if caption:
        ET.SubElement(element, "header").text = caption[:1].upper() + caption[1:]
    element.extend(members)
    return element


def without_repetitions(members):
    """Specialisations of a template repeat each other's constructors."""
    def text_of(member):
        parts = ("templateparamlist", "requiresclause", "name", "argsstring")
        return tuple("".join(part.itertext()) for tag in parts for part in member.findall(tag))

    return list({text_of(member): member for member in reversed(members)}.values())


def show_constraint(member):
    """Breathe shows no requires clause: it goes behind the arguments, where C++ allows it too. Sphinx can parse no
    requires expression in it."""
    clause, arguments = member.find("requiresclause"), member.find("argsstring")
    text = "" if clause is None else "".join(clause.itertext()).strip()
    if text and "requires" not in text and arguments.text:
        arguments.text += f" requires ({text})"
