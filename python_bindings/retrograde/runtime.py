"""Runs functions that were compiled ahead of time, without the compiler, using only NumPy and ctypes.

    from retrograde import runtime
    brighten = runtime.load("libbrighten.so", "brighten")
    brighten(photo, 2.0, out)                   # or by name: brighten(photo, gain=2.0, output=out)

A library comes from `retrograde.compile_to_shared_library`, or from linking the static library of a generator. Arrays
are NumPy's, or objects that NumPy can view without a copy; no data is copied. The axis rule of the package applies:
a[y, x] == f[x, y]. Errors are `retrograde.RuntimeError`, with the library's code and message. A call releases the GIL.
"""
import ctypes
import threading
from ctypes import (CFUNCTYPE, POINTER, Structure, Union, c_bool, c_char_p, c_double, c_float, c_int, c_int8,
                    c_int16, c_int32, c_int64, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)

import numpy

from ._errors import RuntimeError as RetrogradeError

__all__ = ["Argument", "Function", "load"]


# ---- the C ABI: HalideRuntime.h ----

class halide_type_t(Structure):
    _fields_ = [("code", c_uint8), ("bits", c_uint8), ("lanes", c_uint16)]


class halide_dimension_t(Structure):
    _fields_ = [("min", c_int32), ("extent", c_int32), ("stride", c_int32), ("flags", c_uint32)]


class halide_buffer_t(Structure):
    _fields_ = [("device", c_uint64), ("device_interface", c_void_p), ("host", c_void_p), ("flags", c_uint64),
                ("type", halide_type_t), ("dimensions", c_int32), ("dim", POINTER(halide_dimension_t)),
                ("padding", c_void_p)]


class halide_scalar_value_t(Union):
    _fields_ = [("b", c_bool), ("i8", c_int8), ("i16", c_int16), ("i32", c_int32), ("i64", c_int64), ("u8", c_uint8),
                ("u16", c_uint16), ("u32", c_uint32), ("u64", c_uint64), ("f32", c_float), ("f64", c_double),
                ("handle", c_void_p)]


class halide_filter_argument_t(Structure):
    _fields_ = [("name", c_char_p), ("kind", c_int32), ("dimensions", c_int32), ("type", halide_type_t),
                ("scalar_def", POINTER(halide_scalar_value_t)), ("scalar_min", POINTER(halide_scalar_value_t)),
                ("scalar_max", POINTER(halide_scalar_value_t)), ("scalar_estimate", POINTER(halide_scalar_value_t)),
                ("buffer_estimates", POINTER(POINTER(c_int64)))]


class halide_filter_metadata_t(Structure):
    _fields_ = [("version", c_int32), ("num_arguments", c_int32), ("arguments", POINTER(halide_filter_argument_t)),
                ("target", c_char_p), ("name", c_char_p)]


class halide_trace_event_t(Structure):
    _fields_ = [("func", c_char_p), ("value", c_void_p), ("coordinates", POINTER(c_int32)), ("trace_tag", c_char_p),
                ("type", halide_type_t), ("event", c_int32), ("parent_id", c_int32), ("value_index", c_int32),
                ("dimensions", c_int32)]


INT, UINT, FLOAT, HANDLE, BFLOAT = range(5)
ERROR_HANDLER = CFUNCTYPE(None, c_void_p, c_char_p)


# ---- arguments ----

class Argument:
    """An argument of a function: its `name`, `kind`, `dtype` and `dimensions`, and for scalars the `default`."""

    KINDS = ("scalar", "input", "output")

    def __init__(self, of):
        self.name, self.kind, self.dimensions = of.name.decode(), self.KINDS[of.kind], of.dimensions
        self.code, self.bits = of.type.code, of.type.bits
        self.default = self.value_of(of.scalar_def[0]) if of.scalar_def else None

    @property
    def dtype(self):
        """The NumPy dtype; uint16, the bits, for bfloat16, which NumPy lacks."""
        if self.code == BFLOAT:
            return numpy.dtype("uint16")
        if self.code == HANDLE:
            return numpy.dtype("uint64")
        if self.code == UINT and self.bits == 1:
            return numpy.dtype(bool)
        return numpy.dtype("iuf"[self.code] + str(self.bits // 8))

    @property
    def field(self):
        """The field of halide_scalar_value_t."""
        if self.code == UINT and self.bits == 1:
            return "b"
        return {INT: "i", UINT: "u", FLOAT: "f"}.get(self.code, "handle") + (str(self.bits) if self.code < 3 else "")

    def value_of(self, value):
        return value.u16 if self.bits == 16 and self.code >= FLOAT else getattr(value, self.field)

    def scalar(self, given):
        """The value as an array whose memory the function reads."""
        dtype = self.dtype
        array = numpy.asarray(given)
        if array.shape != () or array.dtype.kind not in ("iub" if dtype.kind in "iu" else "iubf"):
            raise TypeError(f"{self.name} is a number of type {dtype}, not {given!r}")
        value = array.astype(dtype)
        if dtype.kind in "iu" and int(value) != int(array):
            raise OverflowError(f"{self.name} is of type {dtype}, which {given!r} does not fit")
        return value

    def __repr__(self):
        shape = f", {self.dimensions} dimensions" if self.kind != "scalar" else ""
        return f"<{self.kind} {self.name}: {self.dtype}{shape}>"


class _Image:
    """An array as a halide_buffer_t, with the axes in reverse as its dimensions."""

    def __init__(self, argument, given):
        array = given if isinstance(given, numpy.ndarray) else numpy.asarray(given)
        self.owner = array
        if array.dtype != argument.dtype:
            raise TypeError(f"{argument.name} holds {argument.dtype}, not {array.dtype}")
        if array.ndim != argument.dimensions:
            raise TypeError(f"{argument.name} has {argument.dimensions} dimensions, not {array.ndim}")
        if argument.kind == "output":
            self.check_output(argument, array, given)
        if any(stride % array.itemsize for stride in array.strides):
            raise TypeError(f"the strides of {argument.name} are no multiples of its elements")
        if any(abs(n) > 0x7fffffff for n in array.shape) or any(
                abs(n // array.itemsize) > 0x7fffffff for n in array.strides):
            raise OverflowError(f"{argument.name} has sizes or strides beyond 2^31 - 1 elements")
        self.dims = (halide_dimension_t * max(array.ndim, 1))()
        for d, (extent, stride) in enumerate(zip(reversed(array.shape), reversed(array.strides))):
            self.dims[d].extent, self.dims[d].stride = extent, stride // array.itemsize
        self.buffer = halide_buffer_t(host=array.ctypes.data, dimensions=array.ndim, dim=self.dims,
                                      type=halide_type_t(argument.code, argument.bits, 1))

    @staticmethod
    def check_output(argument, array, given):
        if not array.flags.writeable:
            raise ValueError(f"{argument.name} is written to, and the array is read-only")
        if array is not given and not hasattr(given, "__array_interface__") and array.base is None:
            raise TypeError(f"{argument.name} is written to: give an array")


# ---- functions ----

class Function:
    """A function of a library. Call it with arguments in the order of `arguments`, or by name."""

    def __init__(self, library, name):
        self._library = library  # keeps the library loaded
        self._call = getattr(library, name + "_argv")
        self._call.argtypes, self._call.restype = [POINTER(c_void_p)], c_int
        describe = getattr(library, name + "_metadata")
        describe.argtypes, describe.restype = [], POINTER(halide_filter_metadata_t)
        metadata = describe()[0]
        self.name, self.target = metadata.name.decode(), metadata.target.decode()
        self.arguments = [Argument(metadata.arguments[i]) for i in range(metadata.num_arguments)]

    def __call__(self, *args, **named):
        values = self._ordered(args, named)
        kept = [a.scalar(v) if a.kind == "scalar" else _Image(a, v) for a, v in zip(self.arguments, values)]
        self._run(kept)

    def required(self, *args, **named):
        """The regions of the inputs that outputs of these shapes require: {name: [(min, extent), ...]}, innermost
        dimension first. Arguments are those of a call; inputs may be None."""
        values = self._ordered(args, named)
        kept = []
        for argument, value in zip(self.arguments, values):
            if value is None and argument.kind == "input":
                value = numpy.empty((0,) * argument.dimensions, argument.dtype)
            image = argument.scalar(value) if argument.kind == "scalar" else _Image(argument, value)
            if argument.kind == "input":
                image.buffer.host = None
            kept.append(image)
        self._run(kept)
        return {a.name: [(image.dims[d].min, image.dims[d].extent) for d in range(a.dimensions)]
                for a, image in zip(self.arguments, kept) if a.kind == "input"}

    def _ordered(self, args, named):
        names = [a.name for a in self.arguments]
        unknown = set(named) - set(names)
        if unknown or len(args) > len(names):
            raise TypeError(f"{self.name} takes {', '.join(names)}, not {', '.join(sorted(unknown)) or len(args)}")
        values = list(args)
        for argument in self.arguments[len(args):]:
            if argument.name not in named and argument.default is None:
                raise TypeError(f"{self.name} needs {argument!r}")
            values.append(named.pop(argument.name, argument.default))
        if named:
            raise TypeError(f"{self.name} was given {', '.join(sorted(named))} twice")
        return values

    def _run(self, kept):
        pointers = (c_void_p * len(kept))()
        for i, value in enumerate(kept):
            pointers[i] = ctypes.addressof(value.buffer) if isinstance(value, _Image) else value.ctypes.data
        _said.text = ""
        code = self._call(pointers)
        if code:
            error = RetrogradeError(_said.text or f"{self.name} returned the error {code}")
            error.code = code
            raise error

    def __repr__(self):
        return f"<{self.name} for {self.target}: {', '.join(repr(a) for a in self.arguments)}>"


_said = threading.local()  # the error message of this thread's call


@ERROR_HANDLER
def _on_error(context, message):
    _said.text = message.decode(errors="replace").rstrip("\n")


def load(path, name):
    """Loads the function `name` of a shared library. Its errors become exceptions instead of printing and aborting."""
    library = ctypes.CDLL(str(path))
    try:
        set_handler = library.halide_set_error_handler
    except AttributeError:
        pass  # the runtime is in another library
    else:
        set_handler.argtypes, set_handler.restype = [ERROR_HANDLER], c_void_p
        set_handler(_on_error)
    try:
        return Function(library, name)
    except AttributeError:
        raise ValueError(f"{path} has no function {name} with metadata") from None
