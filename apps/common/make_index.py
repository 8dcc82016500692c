#!/usr/bin/env python3
"""Writes FOLDER/index.html: one self-contained page about FOLDER/report.json and FOLDER/*/report.json.

usage: make_index.py FOLDER

It contains the pictures before and after, plots, numbers and tables that each report lists. Pictures are shown
at most 1000 pixels wide; large ones are stored as JPEG.
"""
import base64
import html
import io
import json
import os
import sys

WIDEST = 1000
LARGE_BYTES = 300_000

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 1100px; padding: 0 1rem; color: #222; }
h1 { font-size: 1.6rem; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; }
figure { display: inline-block; margin: .4rem; vertical-align: top; max-width: 48%; }
figure img { max-width: 100%; image-rendering: auto; } figcaption { color: #555; font-size: .9em; }
table { border-collapse: collapse; margin: .8rem 0; } caption { text-align: left; font-weight: 600; }
td, th { border: 1px solid #ddd; padding: .2rem .6rem; text-align: left; } td.number { text-align: right; }
"""


def picture_uri(path):
    """The picture as a data URI; None if it is missing or not a picture."""
    from PIL import Image, UnidentifiedImageError

    Image.MAX_IMAGE_PIXELS = None
    try:
        with Image.open(path) as image:
            kind = (image.format or "").lower()
            image.load()
            small = image.width <= WIDEST and os.path.getsize(path) <= LARGE_BYTES
            if kind == "gif" or (small and kind in ("png", "jpeg")):
                with open(path, "rb") as file:
                    data = file.read()
            else:
                data, kind = shrunk(image)
    except (OSError, UnidentifiedImageError):
        return None
    return f"data:image/{kind};base64,{base64.b64encode(data).decode()}"


def shrunk(image):
    from PIL import Image

    if image.mode.startswith("I"):  # 16 bits per sample
        image = image.point(lambda v: v / 257)
    image = image.convert("RGB")
    if image.width > WIDEST:
        height = max(1, round(image.height * WIDEST / image.width))
        image = image.resize((WIDEST, height), Image.LANCZOS)
    out = io.BytesIO()
    image.save(out, "JPEG", quality=90)
    return out.getvalue(), "jpeg"


def number_text(value):
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return "-" if value is None else str(value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def cell(value):
    kind = ' class="number"' if isinstance(value, (int, float)) else ""
    return f"<td{kind}>{html.escape(number_text(value))}</td>"


def table(title, head, rows):
    yield f"<table><caption>{html.escape(title)}</caption>"
    yield "<tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in head) + "</tr>"
    for row in rows:
        yield "<tr>" + "".join(cell(value) for value in row) + "</tr>"
    yield "</table>"


def figure(folder, file, caption):
    uri = picture_uri(os.path.join(folder, file))
    text = html.escape(caption or file)
    if uri is None:
        return f"<p>{html.escape(file)} is missing ({text}).</p>"
    return f'<figure><img alt="{text}" src="{uri}"><figcaption>{text}</figcaption></figure>'


def facts(report):
    seconds, memory = report.get("seconds"), report.get("peak_memory_mb")
    parts = [f"{report.get('steps', 0)} steps", f"{report.get('threads', 1)} threads"]
    if seconds is not None:
        parts.append(f"{seconds:.1f} s")
    if memory is not None:
        parts.append(f"{memory:.0f} MB")
    if report.get("stopped"):
        parts.append("stopped before its end")
    return ", ".join(parts)


def section(folder, report):
    yield f"<h2>{html.escape(report.get('program', os.path.basename(folder)))}</h2>"
    yield f"<p>{html.escape(facts(report))}; input {html.escape(str(report.get('input', '-')))}</p>"
    for picture in report.get("pictures", []):
        yield figure(folder, picture["file"], picture["caption"])
    numbers = report.get("numbers", [])
    if numbers:
        rows = [[n["name"], n.get("before"), n["value"], n.get("unit", ""), n.get("limit", "")] for n in numbers]
        yield from table("numbers", ["", "before", "after", "unit", "wanted"], rows)
    for plot in report.get("plots", []):
        yield figure(folder, plot["file"], plot.get("title", ""))
    for one in report.get("tables", []):
        yield from table(one["title"], one["head"], one["rows"])
    for note in report.get("notes", []):
        yield f"<p>{html.escape(note)}</p>"


def reports_in(folder):
    folders = [folder] + sorted(entry.path for entry in os.scandir(folder) if entry.is_dir())
    for one in folders:
        path = os.path.join(one, "report.json")
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                yield one, json.load(file)


def main():
    if len(sys.argv) != 2 or not os.path.isdir(sys.argv[1]):
        sys.exit(__doc__.strip())
    body = [line for folder, report in reports_in(sys.argv[1]) for line in section(folder, report)]
    if not body:
        sys.exit(f"cannot write {sys.argv[1]}/index.html: it shows reports; there is none. Run tools/demo first.")
    page = "\n".join(
        ["<!DOCTYPE html>", '<html lang="en"><head><meta charset="utf-8"><title>Retrograde: demos</title>']
        + [f"<style>{STYLE}</style></head><body>", "<h1>Retrograde: what the demos did</h1>"]
        + body
        + ["</body></html>\n"]
    )
    path = os.path.join(sys.argv[1], "index.html")
    temporary = f"{path}.{os.getpid()}.tmp"
    try:
        with open(temporary, "w", encoding="utf-8") as file:
            file.write(page)
        os.replace(temporary, path)
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


if __name__ == "__main__":
    main()
