"""Reads and writes pictures as planar arrays, `picture[channel, y, x]`, which a Func reads as f(x, y, channel).

    image = rg.Buffer(retrograde.imageio.imread("photo.png"))
    retrograde.imageio.imwrite("out.png", numpy.asarray(result))

Grey pictures are `picture[y, x]`. The package imageio reads and writes the files, or Pillow if imageio is missing.
"""
import numpy as np


def is_interleaved(im):
    """Whether the channels of each pixel of `im[channel, y, x]` are adjacent in memory."""
    return im.ndim == 3 and im.strides[0] == im.itemsize and im.strides[2] == im.shape[0] * im.itemsize


def copy_to_interleaved(im):
    """A copy of the picture in which the channels of each pixel are adjacent in memory."""
    return np.moveaxis(np.moveaxis(im, 0, 2).copy(), 2, 0) if im.ndim == 3 else im.copy()


def copy_to_planar(im):
    """A copy of the picture with one plane after another in memory."""
    return im.copy(order="C")


def imread(uri, format=None, **kwargs):
    """Reads a picture: `im[channel, y, x]`, or `im[y, x]` if it is grey."""
    pixels = _read(uri, format, kwargs)
    return copy_to_planar(np.moveaxis(pixels, 2, 0)) if pixels.ndim == 3 else pixels


def imwrite(uri, im, format=None, **kwargs):
    """Writes a picture: `im[channel, y, x]` or `im[y, x]`."""
    im = np.asarray(im)
    if im.ndim not in (2, 3):
        raise ValueError(f"a picture has two or three dimensions, this array has {im.ndim}: give it planes or none")
    _write(uri, np.ascontiguousarray(np.moveaxis(im, 0, 2)) if im.ndim == 3 else im, format, kwargs)


def _read(uri, format, kwargs):
    imageio = _package()
    if imageio:
        return np.asarray(imageio.imread(uri, format, **kwargs))
    from PIL import Image
    with Image.open(uri, **kwargs) as picture:
        return np.asarray(picture.convert("RGB") if picture.mode == "P" else picture)


def _write(uri, pixels, format, kwargs):
    imageio = _package()
    if imageio:
        imageio.imwrite(uri, pixels, format, **kwargs)
    else:
        from PIL import Image
        one = pixels[:, :, 0] if pixels.ndim == 3 and pixels.shape[2] == 1 else pixels
        Image.fromarray(one).save(uri, format, **kwargs)


def _package():
    try:
        import imageio.v2
        return imageio.v2
    except ImportError:
        return None
