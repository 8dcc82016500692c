"""explain(): where the time of a pipeline goes, in plain words."""
import re

from . import _retrograde as rg

MOST_STAGES = 12  # that are listed
MOST_SMALL_STAGES = 6  # that are listed although they take less than 0.5 %


def explain(outputs, sizes=None, input_sizes=None, target=None):
    """What compiled code of a pipeline does, as text: the loops of each stage, slowest first, what bounds the stage,
    which intermediate results are stored and which are recomputed, and hints.

        print(rg.explain(blur, [640, 480]))
        print(rg.explain([derivative(image), derivative(taps)], [[640, 480], [3]], {"image": [640, 480]}))

    `outputs` is a Func, a list of Funcs, such as gradients, or a Pipeline. `sizes` are those of the outputs, dimension
    0 first: one list for all, or a list of lists; None: their estimates. `input_sizes` has those of images, by name;
    images that it lacks have the sizes that are set, promised or estimated. Funcs without directives are shown with the
    schedule of auto_schedule() if no Func has any.

    Nothing runs. Times are predictions of the cost model (docs/autoscheduler.md), best used to compare stages. Measured
    times are those of explain_schedule() with ExplainOptions(measure=True)."""
    pipeline = outputs if isinstance(outputs, rg.Pipeline) else \
        rg.Pipeline([outputs] if isinstance(outputs, rg.Func) else list(outputs))
    lists = [] if sizes is None else list(sizes)
    if lists and not isinstance(lists[0], (list, tuple)):
        lists = [lists]
    found = stages_of(pipeline, lists, input_sizes or {}, target)
    return "\n".join([machine_line(found), f"all stages: {found['ms']:.3g} ms", *lines(found)]) + "\n"


def stages_of(pipeline, sizes, input_sizes, target=None):
    """The facts that `lines` writes, as a dict."""
    target = rg.get_jit_target_from_environment() if target is None else target
    return rg._explain_stages(pipeline._scheduled_copy(target), target, [list(one) for one in sizes],
                              {name: list(one) for name, one in input_sizes.items()})


def machine_line(found):
    machine = "built-in constants (run `tune --machine` to measure this machine)" \
        if found["machine"] == "constants" else f"figures of {found['machine']}"
    return f"Times are predicted for {found['threads']} threads, from {machine}."


def size_of(number):
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if number >= factor:
            return f"{number / factor:.3g} {unit}"
    return f"{number:.0f} bytes"


def alike(stages):
    """Stages of one name with the same loops as one stage, slowest first. They are made for similar terms."""
    merged = {}
    for stage in stages:
        key = stage["name"], tuple(stage["loops"])
        if key in merged:
            merged[key]["ms"] += stage["ms"]
            merged[key]["count"] += 1
        else:
            merged[key] = {**stage, "count": 1}
    return sorted(merged.values(), key=lambda stage: -stage["ms"])


def lines(found, indent="  "):
    """The lines about the stages of a pipeline."""
    result, all_ms = [], found["ms"] or 1
    stages = alike(found["stages"])
    shown = [stage for at, stage in enumerate(stages[:MOST_STAGES])
             if at < MOST_SMALL_STAGES or stage["ms"] >= 0.005 * all_ms]
    for stage in shown:
        count = f", {stage['count']} times" if stage["count"] > 1 else ""
        result.append(f'{indent}"{stage["name"]}"{count}: {stage["ms"]:.3g} ms, {100 * stage["ms"] / all_ms:.0f} %, '
                      f'bound by {stage["bound"]}')
        result += [f"{indent}  {loops}" for loops in stage["loops"]]
        result += [f"{indent}  hint: {hint}." for hint in stage["hints"]]
    rest = stages[len(shown):]
    if rest:
        count = sum(stage["count"] for stage in rest)
        result.append(f"{indent}and {count} more stages, {sum(stage['ms'] for stage in rest):.3g} ms together")
    if found["stored"]:
        result.append(f"{indent}stored: " + listed([f'"{name}" ({size_of(size)})' for name, size in found["stored"]]))
    if found["recomputed"]:
        result.append(f"{indent}recomputed at each read: " + listed([f'"{name}"' for name in found["recomputed"]]))
    return result


def plain(text):
    """Names without the numbers that make them unique."""
    return re.sub(r"\$\d+", "", text)


def listed(words, most=8):
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return ", ".join(words[:most]) + more
