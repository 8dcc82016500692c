"""The app learned_retouching: its two slicing layers are the same function, and train alike. Ends with 77, which ctest
counts as skipped, without PyTorch or matplotlib."""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import matplotlib  # noqa: F401
    import torch
except ModuleNotFoundError as missing:
    print("skipped:", missing, "for", sys.executable)
    sys.exit(77)

APP = Path(__file__).resolve().parents[2] / "apps" / "learned_retouching"
sys.path.insert(0, str(APP))
from slicing import slice_by_pipeline, slice_by_pytorch


class LearnedRetouching(unittest.TestCase):
    def test_the_layers_are_one_function(self):
        generator = torch.Generator().manual_seed(3)
        tensors = [torch.rand(shape, generator=generator, dtype=torch.float64, requires_grad=True)
                   for shape in ((2, 3, 9, 7), (2, 9, 7), (2, 3, 4, 4, 3, 3))]
        results = slice_by_pipeline(*tensors), slice_by_pytorch(*tensors)
        torch.testing.assert_close(*results, rtol=1e-12, atol=1e-12)
        gradients = [torch.autograd.grad(result.square().sum(), tensors) for result in results]
        torch.testing.assert_close(*gradients, rtol=1e-11, atol=1e-11)

    def test_photographs_are_upright_and_whole(self):
        from PIL import Image
        from train import photographs
        with tempfile.TemporaryDirectory() as folder:
            exif = Image.Exif()
            exif[274] = 6  # the first row is the right side
            picture = Image.new("RGB", (40, 24), (255, 0, 0))
            picture.paste((0, 0, 255), (20, 0, 40, 24))
            picture.save(Path(folder, "a.jpg"), exif=exif, quality=95)
            pixels, = photographs(folder)
            self.assertEqual(pixels.shape, (3, 40, 24))
            self.assertGreater(pixels[0, :16].min().item(), 0.9)  # what was left is on top
            self.assertLess(pixels[0, 24:].max().item(), 0.1)
            whole = Path(folder, "a.jpg").read_bytes()
            Path(folder, "a.jpg").write_bytes(whole[:len(whole) * 2 // 3])
            with self.assertRaisesRegex(SystemExit, "whole picture"):
                list(photographs(folder))

    def test_they_train_alike(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, "-B", APP / "train.py", "--steps", "12", "--size", "64", "--batch", "2",
                            "--output", folder], check=True, stdout=subprocess.DEVNULL)
            report = json.loads(Path(folder, "report.json").read_text())
            self.assertTrue(Path(folder, "learned_retouching.png").exists())
        self.assertLess(report["largest_relative_difference_of_losses"], 1e-3)
        losses = report["pipeline"]["losses"]
        self.assertLess(sum(losses[-4:]), 0.8 * sum(losses[:4]))


if __name__ == "__main__":
    unittest.main()
