"""Loops over time, and memory.

A simulation of n steps overwrites its state n times, and the way back needs every state. Keeping all costs n states of
memory. Keeping a few and computing the steps between them again costs time, and less than one would think. The gradient is
the same, to the last bit.
"""
import numpy as np
import retrograde as rg
from claims import claim

pendulums, steps = 16, 200
start = 0.5 + 0.0625 * np.arange(pendulums, dtype="float32")
wanted = 0.25 - 0.03125 * np.arange(pendulums, dtype="float32")
begin, goal = rg.Buffer(start), rg.Buffer(wanted)


def miss():
    """Pendulums that start at given angles: the sum of squares of the angles at the end, wanted ones taken off."""
    x, state, loss = rg.Var("x"), rg.Func("state"), rg.Func("loss")
    t, every = rg.RDom([(0, steps)]), rg.RDom([(0, pendulums)])
    state[x] = (begin[x], rg.f32(0))  # angle and speed
    speed = state[x][1] - 0.015625 * rg.sin(state[x][0]) + 0.0 * rg.f32(t)
    state[x] = (state[x][0] + 0.015625 * speed, speed)
    loss[()] = rg.f32(0)
    loss[()] += rg.pow(state[every][0] - goal[every], 2)
    return loss


def gradient_with(**options):
    return rg.propagate_adjoints(miss(), rg.AdjointOptions(**options))


# ---- All states, or a few: the same bits. ----
everything = np.asarray(gradient_with(overwritten=rg.Overwritten.Store)(begin).realize([pendulums]))
works, memories, same = [], [], True
for states in (1, 2, 4, 8, 16, 32):
    d = gradient_with(checkpoint_states=states)
    same = same and (np.asarray(d(begin).realize([pendulums])) == everything).all()
    works.append(d.operations().gradient.operations())
    memories.append(d.operations().gradient.bytes())
    print("%2d states: %9.0f operations, %7.0f bytes" % (states, works[-1], memories[-1]))
claim(same, "1 to 32 kept states of 200 give the bits that all of them give")

# ---- What it costs: with s states, r n - C(s + r, r - 1) steps again (docs/derivatives.md). ----
claim(works[5] < works[2] < works[0], "more states, fewer steps again")
claim(memories[0] < memories[2] < memories[5], "and more memory")
claim(works[3] < works[0] / 8, "eight states already save seven eighths of what one state costs")

# ---- A budget in bytes does the same: it holds as many states as fit. ----
budget = gradient_with(checkpoint_bytes=4096)(begin).realize([pendulums])
claim((np.asarray(budget) == everything).all(), "a budget in bytes gives them, too")

# ---- What it is for: where must the pendulums start to end where we want them? ----
loss = miss()
gradient = rg.propagate_adjoints(loss, rg.AdjointOptions(checkpoint_states=8))(begin)
losses = []
for n in range(40):
    losses.append(loss.realize()[()])
    start -= np.float32(0.4) * np.asarray(gradient.realize([pendulums]))
claim(losses[-1] < 0.01 * losses[0], "forty steps downhill: the miss falls below a hundredth")
