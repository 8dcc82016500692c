"""The app learned_retouching on several processes of torchrun, over gloo: the same bits for any number of them in the
reproducible mode. Ends with 77, which ctest counts as skipped, without PyTorch or matplotlib."""
import json
import os
import socket
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import matplotlib  # noqa: F401
    import torch  # noqa: F401
except ModuleNotFoundError as missing:
    print("skipped:", missing, "for", sys.executable)
    sys.exit(77)

PROGRAM = Path(__file__).resolve().parents[2] / "apps" / "learned_retouching" / "train_in_parallel.py"


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def train(processes, *options):
    with tempfile.TemporaryDirectory() as folder:
        # torchrun of PyTorch 1.13 needs an explicit destination for output to start under Python 3.11.
        subprocess.run([sys.executable, "-B", "-m", "torch.distributed.run", "--nproc_per_node", str(processes),
                        "--master_addr", "127.0.0.1", "--master_port", str(free_port()), "--redirects", "1", "--tee", "1",
                        PROGRAM, "--steps", "2", "--size", "64", "--batch", "4", "--output", folder, *options],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                       env={**os.environ, "GLOO_SOCKET_IFNAME": "lo", "OMP_NUM_THREADS": "1"})
        return json.loads(Path(folder, "report.json").read_text())


class InParallel(unittest.TestCase):
    def test_reproducible_training_takes_the_same_steps_on_any_number_of_processes(self):
        reports = [train(count, "--reproducible") for count in (1, 2, 4)]
        self.assertEqual([report["processes"] for report in reports], [1, 2, 4])
        self.assertTrue(all(report["same_weights_everywhere"] for report in reports))
        self.assertEqual(len({report["weights"] for report in reports}), 1)
        self.assertEqual(len({tuple(report["losses"]) for report in reports}), 1)

    def test_shares_train_like_samples(self):
        samples, shares = train(1, "--reproducible"), train(2)
        self.assertTrue(shares["same_weights_everywhere"])
        for a, b in zip(samples["losses"], shares["losses"], strict=True):
            self.assertAlmostEqual(a, b, delta=1e-3 * a)

    def test_it_is_started_by_torchrun(self):
        alone = subprocess.run([sys.executable, "-B", PROGRAM], capture_output=True, text=True,
                               env={k: v for k, v in os.environ.items() if k != "RANK"})
        self.assertEqual(alone.returncode, 1)
        self.assertIn("torchrun --nproc_per_node", alone.stderr)


if __name__ == "__main__":
    unittest.main()
