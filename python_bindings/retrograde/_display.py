"""Display in notebooks: a Func shows its loops, a Buffer its picture."""
import html
import struct
import zlib

import numpy

from . import _retrograde as rg
from ._errors import Error

LARGEST = 1024  # pixels along a side; larger pictures are subsampled


def loops_as_html(func):
    """The scheduled loops as HTML. If the Func cannot be lowered yet, its repr and the error."""
    try:
        text = func.loop_nest()
    except Error as problem:
        text = f"{func!r}\n{problem}"
    return f"<pre>{html.escape(text)}</pre>"


def as_bytes(a):
    """Values as brightness. Bytes are kept, wider unsigned integers use their high bits, and floats map [0, 1].
    Signed integers, and floats outside of [0, 1], are scaled between their smallest and largest value."""
    if a.dtype == bool:
        return a * numpy.uint8(255)
    if a.dtype.kind == "u":
        return (a >> (8 * (a.itemsize - 1))).astype(numpy.uint8)
    a = a.astype(numpy.float64)
    finite = a[numpy.isfinite(a)]
    low, high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)
    if not (0 <= low and high <= 1):
        a = (a - low) / ((high - low) or 1)
    return (numpy.nan_to_num(a, posinf=1, neginf=0).clip(0, 1) * 255 + 0.5).astype(numpy.uint8)


def png(pixels):
    """A PNG file of the bytes pixels[y, x] or pixels[y, x, channel]."""
    height, width = pixels.shape[:2]
    channels = 1 if pixels.ndim == 2 else pixels.shape[2]
    rows = numpy.zeros((height, 1 + width * channels), numpy.uint8)  # each row begins with its filter: none
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes()))
            + chunk(b"IEND", b""))


def picture(buffer):
    """A PNG file of a Buffer over x and y, or over x, y and up to four channels; None for other Buffers."""
    if not buffer.defined() or buffer.dimensions() not in (1, 2, 3) or 0 in buffer.shape:
        return None
    if buffer.type() == rg.BFloat(16):
        return None  # NumPy has no bfloat16
    a = numpy.asarray(buffer)
    if a.ndim == 3 and a.shape[0] > 4:
        return None
    a = a[None, :] if a.ndim == 1 else a
    step = max(1, *(-(-n // LARGEST) for n in a.shape[-2:]))
    pixels = as_bytes(a[..., ::step, ::step])
    return png(pixels if a.ndim == 2 else numpy.moveaxis(pixels, 0, 2))


rg.Func._repr_html_ = loops_as_html
rg.Buffer._repr_png_ = picture
