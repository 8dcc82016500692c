"""The gallery: a card for each app and each tutorial that draws, made of their READMEs."""
import re

PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
ROW = re.compile(r"\| `(\w+)\.cpp` \| ([^|]+) \| !\[\]\((pictures/[^)]+)\) \|")
# The README of this app shows no picture: it is the one that the home page begins with.
MORE_PICTURES = {"bilateral_slice": "/docs/pictures/demo.jpg"}
OPENING = """# Gallery

## Applications

Programs in the language, each with its numbers, its gradients checked, and a command that runs it: `tools/demo NAME`.
"""


def write_gallery(root, work):
    apps = sorted(path.parent for path in root.glob("apps/*/README.md") if (path.parent / "demo").exists()
                  or path.parent.name == "learned_retouching")
    cards = sorted(map(app_card, apps), key=lambda card: not card[3])  # those with a picture first
    tutorials = [card for folder in ("gradients", "gpu") for card in tutorial_cards(root, folder)]
    pages = "\n```{toctree}\n:hidden:\n\n" + "\n".join(page for _, _, page, _ in cards) + "\n```\n"
    (work / "gallery.md").write_text(
        OPENING + cards_text(cards) + "\n## Tutorials\n" + cards_text(tutorials) + pages)


def app_card(folder):
    text = (folder / "README.md").read_text()
    pictures = [f"/apps/{folder.name}/{match.group(2)}" for match in PICTURE.finditer(text)]
    pictures += [MORE_PICTURES[folder.name]] if folder.name in MORE_PICTURES else []
    return folder.name, first_paragraph(text), f"apps/{folder.name}/README", pictures[0] if pictures else ""


def first_paragraph(text):
    """The first sentence below the title."""
    paragraph = " ".join(text.split("\n\n")[1].split())
    return re.match(r".+?(?=[.:](\s|$))", paragraph + ".").group(0) + "."


def tutorial_cards(root, folder):
    text = (root / "test/tutorials" / folder / "README.md").read_text()
    for name, what, picture in ROW.findall(text):
        yield (name.replace("_", " ").capitalize(), what, f"tutorials/{folder}/{name}",
               f"/test/tutorials/{folder}/{picture}")


def cards_text(cards):
    return "\n:::::{container} cards\n" + "".join(card_text(*card) for card in cards) + ":::::\n"


def card_text(title, text, page, picture):
    image = f":::{{image}} {picture}\n:target: {page}.html\n:alt: {title}\n:::\n" if picture else ""
    return f"::::{{container}} card\n{image}\n**[{title}]({page})**\n\n{text}\n::::\n"
