"""Whether a call of an operator is one that the dispatcher would pass on as it is: to autograd, and to the kernel of
the CPU.

Such a call need not go through it, which takes several times as long as calling both from here: what it does is to look
for modes, transforms and kinds of tensors that there are not. All else goes through the dispatcher: what torch.compile
and torch.jit trace, FakeTensors and other subclasses, functorch's transforms, forward mode, autocast, modes that watch
calls, profilers, and what runs below autograd.
"""
import threading

import torch
from torch import _C
from torch.autograd import forward_ad

is_compiling = getattr(getattr(torch, "compiler", None), "is_compiling", lambda: False)
_count_modes = _C._len_torch_function_stack
_is_profiled = torch.autograd._profiler_enabled


def count_maps():
    """The levels of autograd's older vmap that are open."""
    before = _C._vmapmode_increment_nesting() - 1
    _C._vmapmode_decrement_nesting()
    return before


_TYPES = {torch.Tensor, torch.nn.Parameter}


def is_direct(tensors):
    """Whether nothing stands between a call on these and the kernels of autograd and of the CPU."""
    if forward_ad._current_level >= 0 or _count_modes() or _is_profiled() or not _is_ordinary_thread():
        return False
    for t in tensors:
        if type(t) not in _TYPES or not _is_ordinary(t):
            return False
    return True


if hasattr(_C.DispatchKeySet, "raw_repr"):
    # Of a dense tensor of the CPU, and what a thread includes and excludes by itself. A new thread: this one may have
    # modes on while it imports.
    _keys = _C._dispatch_keys
    _included, _excluded = _C._dispatch_tls_local_include_set, _C._dispatch_tls_local_exclude_set
    _found = []
    _thread = threading.Thread(target=lambda: _found.extend(
        keys.raw_repr() for keys in (_keys(torch.empty(0)), _included(), _excluded())))
    _thread.start()
    _thread.join()
    _OF_TENSORS, _OF_INCLUDED, _OF_EXCLUDED = _found

    def _is_ordinary_thread():
        return _included().raw_repr() == _OF_INCLUDED and _excluded().raw_repr() == _OF_EXCLUDED

    def _is_ordinary(t):
        return _keys(t).raw_repr() == _OF_TENSORS
else:  # PyTorch 1.13 does not show its sets of keys; a question for each of those that such a call could have
    _count_dispatch_modes, _has_transforms, _is_traced = \
        _C._len_torch_dispatch_stack, _C._are_functorch_transforms_active, _C._is_tracing
    _has_autocast, _is_excluded = torch.is_autocast_cpu_enabled, _C._dispatch_tls_is_dispatch_key_excluded
    _AUTOGRAD = _C.DispatchKey.AutogradOther  # excluded with autograd's other keys; its name would take 2 us to read
    _is_functional = torch._is_functional_tensor

    def _is_ordinary_thread():
        return not (_count_dispatch_modes() or _has_transforms() or _is_traced() or _has_autocast()
                    or _is_excluded(_AUTOGRAD) or count_maps())

    def _is_ordinary(t):  # a tensor of the CPU without memory has no address either, which is an error
        return t.is_cpu and not t.is_neg() and not t._is_zerotensor() and not _is_functional(t)
