"""Data-parallel training with an operator in the model: DistributedDataParallel on two processes, over gloo, takes the
steps that one process takes with all of the data. Ends with 77, which ctest counts as skipped, without PyTorch."""
import os
import socket
import subprocess
import sys
import unittest

try:
    import torch
    from torch import distributed
except ModuleNotFoundError:
    print("skipped: there is no PyTorch for", sys.executable)
    sys.exit(77)

import retrograde as rg
from retrograde.torch import operator

BATCH, STEPS = 4, 3


class Blur(torch.nn.Module):
    def __init__(self):
        super().__init__()
        x, k, image, taps = rg.Var("x"), rg.RDom([(0, 3)]), rg.ImageParam("float64", 1), rg.ImageParam("float64", 1)
        f = rg.Func("blur")
        f[x] = rg.f64(0)
        f[x] += image[x + k] * taps[k]
        self.op = operator(f, [image, taps], lambda image, taps: [image.shape[0] - 2])
        self.taps = torch.nn.Parameter(torch.tensor([0.2, 0.5, 0.1], dtype=torch.float64))

    def forward(self, images):
        return self.op(images, self.taps)  # a batch of images, and one set of taps


def train(model, images):
    """The taps after some steps; the loss is a mean over the images."""
    optimizer = torch.optim.SGD(model.parameters(), lr=0.1)
    for _ in range(STEPS):
        optimizer.zero_grad()
        model(images).square().mean().backward()
        optimizer.step()
    return next(model.parameters()).tolist()


def all_images():
    return torch.arange(BATCH * 16, dtype=torch.float64).reshape(BATCH, 16).sin()


def work(rank, count):
    distributed.init_process_group("gloo", rank=rank, world_size=count)
    share = BATCH // count
    model = torch.nn.parallel.DistributedDataParallel(Blur())
    print(*train(model, all_images()[rank * share:(rank + 1) * share]))
    distributed.destroy_process_group()


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Distributed(unittest.TestCase):
    def test_two_processes_take_the_steps_of_one(self):
        environment = {**os.environ, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(free_port()),
                       "GLOO_SOCKET_IFNAME": "lo"}
        workers = [subprocess.Popen([sys.executable, "-B", __file__, "work", str(rank), "2"], env=environment,
                                    stdout=subprocess.PIPE, text=True) for rank in range(2)]
        said = [worker.communicate(timeout=120)[0] for worker in workers]
        self.assertEqual([worker.returncode for worker in workers], [0, 0])
        self.assertEqual(said[0], said[1])
        alone = train(Blur(), all_images())
        for value, want in zip(said[0].split(), alone, strict=True):
            self.assertAlmostEqual(float(value), want, places=14)


if __name__ == "__main__":
    if sys.argv[1:2] == ["work"]:
        work(int(sys.argv[2]), int(sys.argv[3]))
    else:
        unittest.main()
