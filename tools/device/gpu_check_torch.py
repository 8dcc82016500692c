"""Runs gpu_check's programs in PyTorch, those that one or two PyTorch calls can compute.

    gpu_check_torch.py TASKS.json

TASKS.json contains the device, a time limit in seconds for everything, the timed programs with their scales,
and files with our results at scale 1. Prints JSON: for each program, milliseconds at its scale, and the
difference between PyTorch's result and ours at scale 1. Programs without such calls are left out and listed.
"""
import json
import statistics
import sys
import time


def picture(torch, width, height, device):
    """As test/support/gpu_programs.cpp makes them."""
    i = torch.arange(width, device=device, dtype=torch.int64)[None, :]
    j = torch.arange(height, device=device, dtype=torch.int64)[:, None]
    return ((i * 37 + j * 101 + (i * j) % 17) % 256).to(torch.float32) / 256


def padded(torch, image):
    return torch.nn.functional.pad(image[None, None], (1, 1, 1, 1), mode="replicate")


def tone_curve(torch, scale, device):
    image = picture(torch, 256 * scale, 64 * scale, device)
    return lambda: image * image * (3.0 - 2.0 * image)


def separable_blur(torch, scale, device):
    image = padded(torch, picture(torch, 128 * scale, 64 * scale, device))
    taps = torch.tensor([0.25, 0.5, 0.25], device=device)
    convolve = torch.nn.functional.conv2d
    return lambda: convolve(convolve(image, taps.view(1, 1, 1, 3)), taps.view(1, 1, 3, 1))


def convolution(torch, scale, device):
    image = padded(torch, picture(torch, 100 * scale, 60 * scale, device))
    weights = picture(torch, 3, 3, device)[None, None]
    return lambda: torch.nn.functional.conv2d(image, weights)


def matrix_product(torch, scale, device):
    a = picture(torch, 64 * scale, 64 * scale, device)
    b = picture(torch, 64 * scale, 64 * scale, device)
    return lambda: a @ b


def training_step(torch, scale, device):
    width, height = 64 * scale, 32 * scale
    image = picture(torch, width + 2, height + 2, device)[None, None]
    wanted = picture(torch, width, height, device)[None, None]
    weights = picture(torch, 3, 3, device)[None, None].requires_grad_()

    def step():
        loss = torch.nn.functional.mse_loss(torch.nn.functional.conv2d(image, weights), wanted)
        (gradient,) = torch.autograd.grad(loss, weights)
        return weights.detach() - 0.1 * gradient

    return step


def reduction(torch, scale, device):
    values = (torch.arange(16384 * scale, device=device) % 1000).to(torch.float32) / 1024
    return lambda: values.sum()


PROGRAMS = {f.__name__: f for f in
            (tone_curve, separable_blur, convolution, matrix_product, training_step, reduction)}


def milliseconds(torch, run, device, seconds):
    def wait():
        if device == "cuda":
            torch.cuda.synchronize()

    run()
    wait()
    begin = time.perf_counter()
    run()
    wait()
    once = max(time.perf_counter() - begin, 1e-7)
    runs = min(1000, max(1, int(seconds / 7 / once)))
    times = []
    for _ in range(7):
        begin = time.perf_counter()
        for _ in range(runs):
            run()
        wait()
        times.append((time.perf_counter() - begin) / runs)
    return 1e3 * statistics.median(times)


def largest_difference(torch, result, file):
    """Relative to the largest value."""
    ours = torch.frombuffer(bytearray(open(file, "rb").read()), dtype=torch.float32).double()
    theirs = result.detach().cpu().double().flatten()
    if ours.numel() != theirs.numel():
        return float("inf")
    return ((ours - theirs).abs().max() / max(theirs.abs().max().item(), 1e-30)).item()


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        tasks = json.load(file)
    try:
        import torch
    except ImportError as problem:
        print(json.dumps({"not_installed": str(problem)}))
        return
    device = tasks["device"]
    if device == "cuda" and not torch.cuda.is_available():
        print(json.dumps({"not_installed": "torch " + torch.__version__ + " is there without CUDA"}))
        return
    torch.backends.cuda.matmul.allow_tf32 = False
    torch.backends.cudnn.allow_tf32 = False
    begin, told, without = time.perf_counter(), {}, []
    for task in tasks["programs"]:
        name = task["name"]
        if name not in PROGRAMS:
            without.append(name)
            continue
        if time.perf_counter() - begin > tasks["seconds"]:
            break
        one = {}
        if name in tasks.get("results", {}):
            one["largest_difference"] = largest_difference(
                torch, PROGRAMS[name](torch, 1, device)(), tasks["results"][name])
        if "scale" in task:
            run = PROGRAMS[name](torch, task["scale"], device)
            one["milliseconds"] = milliseconds(torch, run, device, tasks["seconds"] / 20)
        told[name] = one
    print(json.dumps({"version": torch.__version__, "programs": told, "without_calls": without}))


if __name__ == "__main__":
    main()
