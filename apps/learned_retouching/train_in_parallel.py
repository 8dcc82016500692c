#!/usr/bin/python3
"""train_in_parallel.py -- the network of train.py on several processes, each with a share of every batch.

    torchrun --nproc_per_node N train_in_parallel.py [--reproducible] [--images FOLDER] [--output FOLDER] [--steps N]
                                                     [--size PIXELS] [--batch N] [--threads N] [--seed N]

Uses DistributedDataParallel over gloo: each process differentiates the mean over its share, and gradients are averaged
over processes, so their last bits depend on the number of processes. With --reproducible, each sample is differentiated
separately, and every process sums the gradients of all samples in order. Then the weights are bit-identical for any
number of processes with the same number of threads each. Process 0 writes report.json: the losses, the time of a step,
and a digest of the weights."""
import hashlib
import json
import os
import statistics
import time
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import distributed

from slicing import slice_by_pipeline
from train import Training, large_enough, options_of, retouched


def gathered(mine):
    """Gathers a row for each sample of this process to one for each sample of the batch, in order."""
    parts = [torch.empty_like(mine) for _ in range(distributed.get_world_size())]
    distributed.all_gather(parts, mine)
    return torch.cat(parts)


def sum_in_order(rows):
    total = rows[0].clone()
    for row in rows[1:]:
        total += row
    return total


class ParallelTraining(Training):
    def __init__(self, pictures, options):
        super().__init__(slice_by_pipeline, pictures, options)
        share = options.batch // distributed.get_world_size()
        first = share * distributed.get_rank()
        self.share = slice(first, first + share)
        self.differentiate = self.by_samples if options.reproducible else self.by_shares
        if not options.reproducible:
            self.parallel = torch.nn.parallel.DistributedDataParallel(self.model)

    def step(self):
        images = next(self.batches)[self.share]
        targets = retouched(images)
        start = time.perf_counter()
        losses = self.differentiate(images, targets)
        self.optimizer.step()
        self.seconds.append(time.perf_counter() - start)
        self.losses.append(sum_in_order(gathered(losses)).item() / (len(losses) * distributed.get_world_size()))

    def by_shares(self, images, targets):
        self.optimizer.zero_grad()
        loss = F.mse_loss(self.parallel(images), targets)
        loss.backward()
        return loss.detach()[None]

    def by_samples(self, images, targets):
        parameters, losses, gradients = list(self.model.parameters()), [], []
        for image, target in zip(images[:, None], targets[:, None]):
            loss = F.mse_loss(self.model(image), target)
            gradients.append(torch.cat([g.flatten() for g in torch.autograd.grad(loss, parameters)]))
            losses.append(loss.detach())
        rows = gathered(torch.stack(gradients))
        mean = sum_in_order(rows) / len(rows)
        for parameter, gradient in zip(parameters, mean.split([p.numel() for p in parameters])):
            parameter.grad = gradient.view_as(parameter)
        return torch.stack(losses)

    def digest(self):
        return hashlib.sha256(b"".join(p.detach().numpy().tobytes() for p in self.model.parameters())).hexdigest()


def begin(options):
    if "RANK" not in os.environ:
        raise SystemExit("cannot train in parallel: each process is told its number by torchrun; there is no RANK. "
                         "Start it with torchrun --nproc_per_node N.")
    distributed.init_process_group("gloo")
    count = distributed.get_world_size()
    if options.batch % count:
        raise SystemExit(f"cannot train in parallel: processes have equal shares of a batch; {options.batch} samples "
                         f"are not {count} shares. Choose another --batch or --nproc_per_node.")
    torch.set_num_threads(options.threads)


def main():
    parser = options_of(__doc__, "out/learned_retouching/in_parallel", threads=1)
    parser.add_argument("--reproducible", action="store_true")
    options = parser.parse_args()
    begin(options)
    training = ParallelTraining(large_enough(options), options)
    for _ in range(options.steps):
        training.step()
    digests = [None] * distributed.get_world_size()
    distributed.all_gather_object(digests, training.digest())
    if distributed.get_rank() == 0:
        report = {"processes": len(digests), "reproducible": options.reproducible, "steps": options.steps,
                  "size": options.size, "batch": options.batch, "threads": options.threads,
                  "pytorch": torch.__version__, "same_weights_everywhere": len(set(digests)) == 1,
                  "weights": digests[0], "losses": training.losses,
                  "ms_per_step": 1e3 * statistics.median(training.seconds[1:] or training.seconds)}
        folder = Path(options.output)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "report.json").write_text(json.dumps(report, indent=1))
        print(f"{len(digests)} processes{', reproducible' if options.reproducible else ''}: loss "
              f"{training.losses[0]:.5f} to {training.losses[-1]:.5f}, a step takes {report['ms_per_step']:.1f} ms, "
              f"weights {digests[0][:16]}")
    distributed.destroy_process_group()


if __name__ == "__main__":
    main()
