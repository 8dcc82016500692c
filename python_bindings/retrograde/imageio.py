"""Pictures as arrays in the order of planes, `picture[channel, y, x]`, so that a Func reads them as f(x, y, channel).

    image = rg.Buffer(retrograde.imageio.imread("photo.png"))
    retrograde.imageio.imwrite("out.png", numpy.asarray(result))

Grey pictures are `picture[y, x]`. Files are read and written by the package imageio, or by Pillow where that is missing.
"""
import numpy as np


def is_interleaved(im):
    """Whether the channels of `im[channel, y, x]` lie side by side in memory."""
    return im.ndim == 3 and im.strides[0] == im.itemsize and im.strides[2] == im.shape[0] * im.itemsize


def copy_to_interleaved(im):
    """The same picture, in new memory with the channels of a pixel side by side; grey ones as they are."""
    return np.moveaxis(np.moveaxis(im, 0, 2).copy(), 2, 0) if im.ndim == 3 else im.copy()


def copy_to_planar(im):
    """The same picture, in new memory plane by plane."""
    return im.copy(order="C")


def imread(uri, format=None, **kwargs):
    """The picture in a file."""
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
