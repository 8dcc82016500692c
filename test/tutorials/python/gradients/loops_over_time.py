"""Loops over time: checkpointing.

A simulation of n steps overwrites its state n times, and the backward pass needs every state. Storing all of them takes
the memory of n states. Storing a few and recomputing the steps between them takes time instead, but less than one might
expect. The gradient has the same bits in either case.
"""
import numpy as np
import retrograde as rg
from claims import claim

pendulums, steps = 16, 200
start = 0.5 + 0.0625 * np.arange(pendulums, dtype="float32")
wanted = 0.25 - 0.03125 * np.arange(pendulums, dtype="float32")
begin, goal = rg.Buffer(start), rg.Buffer(wanted)


def miss():
    """Pendulums that start at `start`. The loss is the squared distance of the final angles from `wanted`."""
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


# ---- All states or a few: the gradient has the same bits. ----
everything = np.asarray(gradient_with(overwritten=rg.Overwritten.Store)(begin).realize([pendulums]))
works, memories, same = [], [], True
for states in (1, 2, 4, 8, 16, 32):
    d = gradient_with(checkpoint_states=states)
    same = same and (np.asarray(d(begin).realize([pendulums])) == everything).all()
    works.append(d.operations().gradient.operations())
    memories.append(d.operations().gradient.bytes())
    print("%2d states: %9.0f operations, %7.0f bytes" % (states, works[-1], memories[-1]))
claim(same, "1 to 32 stored states of 200 give the same bits as storing all")

# ---- The cost: s states need r n - C(s + r, r - 1) recomputed steps (docs/derivatives.md). ----
claim(works[5] < works[2] < works[0], "more states, fewer recomputed steps")
claim(memories[0] < memories[2] < memories[5], "and more memory")
claim(works[3] < works[0] / 8, "eight states already save seven eighths of the operations of one state")

# ---- A budget in bytes works the same way: it holds as many states as fit. ----
budget = gradient_with(checkpoint_bytes=4096)(begin).realize([pendulums])
claim((np.asarray(budget) == everything).all(), "a budget in bytes gives the same bits")

# ---- An application: where must the pendulums start to end where we want them? ----
loss = miss()
gradient = rg.propagate_adjoints(loss, rg.AdjointOptions(checkpoint_states=8))(begin)
losses = []
for n in range(40):
    losses.append(loss.realize()[()])
    start -= np.float32(0.4) * np.asarray(gradient.realize([pendulums]))
claim(losses[-1] < 0.01 * losses[0], "forty steps of descent bring the loss below a hundredth")
