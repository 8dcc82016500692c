"""Eight operators (bench/torch/definitions.py) as kernels, beside the CPU's code.

    torch_devices_test.py OPERATOR [unittest's arguments]

The kernels run on the simulated device, of which PyTorch knows nothing: its tensors here are those of the CPU that lie
in the simulated device's memory. Ends with 77, which ctest counts as skipped, where there is no PyTorch."""
import contextlib
import ctypes
import os
import sys
import types
import unittest
from pathlib import Path

try:
    import torch
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

os.environ["RETROGRADE_GPU"] = "simulated"  # before the library looks for a driver
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench" / "torch"))
import numpy as np
import retrograde as rg
from definitions import OPERATORS
from retrograde.torch import operator
from retrograde.torch._device import Device, device_of
from retrograde.torch._plan import GRADIENT, TANGENT
from torch_inputs import inputs_of, values

NAME = sys.argv.pop(1)
OP = operator(f"devices::{NAME}", OPERATORS[NAME])
_memory = []  # Buffers that tensors lie in: as long as the process lives


def on_device(tensor):
    """The same values and strides there."""
    wide = torch.as_strided(tensor, (tensor.untyped_storage().nbytes() // tensor.element_size(),), (1,), 0) \
        if hasattr(tensor, "untyped_storage") else torch.as_strided(tensor, (tensor.storage().size(),), (1,), 0)
    buffer = rg.Buffer(wide.detach().numpy().copy())
    buffer.set_host_dirty()
    buffer.copy_to_device()
    buffer.device_sync()
    described = dict(buffer.__cuda_array_interface__)
    del described["stream"]
    there = torch.from_numpy(np.asarray(types.SimpleNamespace(__array_interface__=described)))
    _memory.append(buffer)
    return torch.as_strided(there, tensor.shape, tensor.stride(), tensor.storage_offset())


class SimulatedDevice(Device):
    """Calls are on a stream of its own."""

    def __init__(self):
        super().__init__(torch.device("cpu"), 80)
        self._driver = ctypes.CDLL(Path(os.environ["RETROGRADE_BUILD_DIR"]) / "libretrograde_simt.so")
        self._kept, self._context, self._stream = [], ctypes.c_void_p(), ctypes.c_void_p()
        self.call("cuInit", 0)
        self.call("cuDevicePrimaryCtxRetain", ctypes.byref(self._context), 0)
        with self.current():
            self.call("cuStreamCreate", ctypes.byref(self._stream), 0)

    def call(self, function, *arguments):
        """Of the driver's; the context is the thread's."""
        code = getattr(self._driver, function)(*arguments)
        if code != 0:
            raise RuntimeError(f"{function} gave {code}")

    @contextlib.contextmanager
    def current(self):
        before = ctypes.c_void_p()
        self.call("cuCtxGetCurrent", ctypes.byref(before))
        self.call("cuCtxSetCurrent", self._context)
        try:
            yield
        finally:
            self.call("cuCtxSetCurrent", before)

    def stream(self):
        return self._stream.value

    def wait(self):
        with self.current():
            self.call("cuStreamSynchronize", self._stream)

    def capture(self, work):
        """What `work` puts into the stream, as a function that runs it again."""
        graph, made = ctypes.c_void_p(), ctypes.c_void_p()
        with self.current():
            self.call("cuStreamBeginCapture_v2", self._stream, 0)
            try:
                work()
            finally:
                self.call("cuStreamEndCapture", self._stream, ctypes.byref(graph))
            self.call("cuGraphInstantiateWithFlags", ctypes.byref(made), graph, ctypes.c_uint64(0))

        def replay():
            with self.current():
                self.call("cuGraphLaunch", made, self._stream)

        return replay

    def empty(self, shape, dtype):
        """Of the results kept for this, as PyTorch's pools are in a capture, or new."""
        for i, kept in enumerate(self._kept):
            if kept.shape == torch.Size(shape) and kept.dtype == dtype:
                return self._kept.pop(i)
        return on_device(torch.full(shape, 77, dtype=dtype))

    @contextlib.contextmanager
    def reusing(self, results):
        self.wait()
        self._kept = list(results)
        yield
        self._kept = []


DEVICE = SimulatedDevice()


def run(path, tensors):
    """Numbers are where the host can read them."""
    plan = OP.plan_for(path, tensors)
    results = plan.run_on(DEVICE, moved(plan, tensors))
    DEVICE.wait()  # a call is in the stream
    return results


def moved(plan, tensors):
    return [on_device(t) if rank else t for t, rank in zip(tensors, plan.ranks)]


class OnDevice(unittest.TestCase):
    def check(self, path, tensors):
        expected, found = OP.plan_for(path, tensors).run(tensors), run(path, tensors)
        for here, there in zip(expected, found):
            torch.testing.assert_close(there, here, rtol=1e-11, atol=1e-11)
        return expected

    def seed(self, tensors):
        return values(*OP.plan_for((), tensors).run(tensors)[0].shape, low=-1, seed=9)

    def test_values(self):
        results = self.check((), inputs_of(NAME))
        self.assertTrue(any(result.abs().max() > 0 for result in results))

    def test_gradients(self):
        tensors = inputs_of(NAME)
        results = self.check((GRADIENT, (1 << len(tensors)) - 1, 1), (*tensors, self.seed(tensors)))
        self.assertTrue(all(result.abs().max() > 0 for result in results))

    def test_tangents(self):
        tensors = inputs_of(NAME)
        self.check((TANGENT, 1, 0), (*tensors, 0.5 * tensors[0]))

    def test_strides_and_a_batch(self):
        tensors = inputs_of(NAME)
        self.check((), tuple(t.movedim(-1, 0).contiguous().movedim(0, -1) if t.dim() > 1 else t for t in tensors))
        first, *rest = tensors
        self.check((), (torch.stack([first, 0.9 * first + 0.01]), *rest))
        self.check((), (first.expand(2, *first.shape), *rest))

    def test_no_elements(self):
        first, *rest = inputs_of(NAME)
        self.assertEqual(run((), (first.new_empty(0, *first.shape), *rest))[0].shape[0], 0)

    def test_a_graph(self):
        """Captured once, it runs on whatever the tensors hold."""
        tensors = inputs_of(NAME)
        path, given = (GRADIENT, (1 << len(tensors)) - 1, 1), (*tensors, self.seed(tensors))
        plan = OP.plan_for(path, given)
        there = moved(plan, given)
        with DEVICE.reusing(plan.run_on(DEVICE, there)):  # the first run loads the kernels
            captured = []
            replay = DEVICE.capture(lambda: captured.extend(plan.run_on(DEVICE, there)))
        others = (0.9 * tensors[0] + 0.01, *given[1:])
        there[0].copy_(others[0])
        replay()
        DEVICE.wait()
        for result, want in zip(captured, plan.run(others)):
            torch.testing.assert_close(result, want, rtol=1e-11, atol=1e-11)

    def test_memory_that_the_driver_does_not_know(self):
        tensors = inputs_of(NAME)
        with self.assertRaisesRegex(rg.RuntimeError, "(?s)wrap.*cuPointerGetAttribute"):
            OP.plan_for((), tensors).run_on(DEVICE, tensors)
        self.check((), tensors)  # nothing is left behind

    def test_arrays_of_a_device(self):
        buffer = rg.Buffer(np.arange(6, dtype="int16").reshape(2, 3))
        buffer.set_host_dirty()
        buffer.copy_to_device()
        described = buffer.__cuda_array_interface__
        self.assertEqual((described["shape"], described["typestr"], described["strides"]), ((2, 3), "<i2", (6, 2)))
        self.assertNotEqual(described["data"][0], buffer.__array_interface__["data"][0])
        buffer.set_host_dirty()
        with self.assertRaisesRegex(rg.CompileError, "newest elements must be there; they are on the host"):
            buffer.__cuda_array_interface__

    def test_schedules_of_a_user(self):
        image, f, x, y, xi, yi = rg.ImageParam("float32", 2), rg.Func(), *(rg.Var() for _ in range(4))
        f[x, y] = image[x, y] * 2
        tensor = values(5, 20, kind=torch.float32)
        f.vectorize(x, 8)
        on_host = operator(f"devices::{NAME}_on_host", f, [image]).plan_for((), [tensor])
        with self.assertRaisesRegex(rg.RuntimeError, "kernels alone.*a stage of it runs on the host.*gpu_tile"):
            on_host.run_on(DEVICE, [on_device(tensor)])
        g = rg.Func()
        g[x, y] = image[x, y] * 2
        g.gpu_tile(x, y, xi, yi, 8, 4)
        tiled = operator(f"devices::{NAME}_tiled", g, [image]).plan_for((), [tensor])
        result, = tiled.run_on(DEVICE, [on_device(tensor)])
        DEVICE.wait()
        self.assertTrue(torch.equal(result, 2 * tensor))

    def test_no_fall_back(self):
        with self.assertRaisesRegex(rg.Unsupported, "simulated device has memory of its own"):
            device_of(torch.device("cuda", 0))
        with self.assertRaisesRegex(rg.Unsupported, "the CPU's or CUDA's"):
            device_of(torch.device("mps"))
        with self.assertRaisesRegex(rg.Unsupported, "compute capability is 7.5 or more"):
            Device(torch.device("cuda", 0), 70)


if __name__ == "__main__":
    unittest.main()
