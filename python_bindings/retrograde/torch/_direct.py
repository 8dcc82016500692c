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
    def _is_ordinary_thread():
        return not (_C._len_torch_dispatch_stack() or _C._are_functorch_transforms_active() or _C._get_tracing_state()
                    or torch.is_autocast_cpu_enabled() or _C._dispatch_tls_is_dispatch_key_excluded("AutogradOther"))

    def _is_ordinary(t):
        return (t.is_cpu and t.layout is torch.strided and not t.is_neg() and not t._is_zerotensor()
                and not torch._is_functional_tensor(t))
