"""Finds calls for which PyTorch's dispatcher would only call autograd and then the CPU kernel.

Such calls bypass the dispatcher, which would only find that no mode, transform or special tensor is involved, and would
take several times as long as calling autograd and the kernel directly. All other calls use the dispatcher: tracing by
torch.compile and torch.jit, FakeTensors and other subclasses, functorch's transforms, forward mode, autocast, dispatch
modes, profilers, and calls below autograd.
"""
import threading

import torch
from torch import _C
from torch.autograd import forward_ad

is_compiling = getattr(getattr(torch, "compiler", None), "is_compiling", lambda: False)
_count_modes = _C._len_torch_function_stack
_is_profiled = torch.autograd._profiler_enabled


def count_maps():
    """The number of active levels of autograd's older vmap."""
    before = _C._vmapmode_increment_nesting() - 1
    _C._vmapmode_decrement_nesting()
    return before


_TYPES = {torch.Tensor, torch.nn.Parameter}


def is_direct(tensors):
    """Whether a call on these tensors needs only the kernels of autograd and of the CPU."""
    if forward_ad._current_level >= 0 or _count_modes() or _is_profiled() or not _is_ordinary_thread():
        return False
    for t in tensors:
        if type(t) not in _TYPES or not _is_ordinary(t):
            return False
    return True


if hasattr(_C.DispatchKeySet, "raw_repr"):
    # The key sets of a dense CPU tensor and of a thread without modes. They are read on a new thread, because modes may
    # be active on this one during the import.
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
else:  # PyTorch 1.13 does not expose its key sets, so each possible key is tested
    _count_dispatch_modes, _has_transforms, _is_traced = \
        _C._len_torch_dispatch_stack, _C._are_functorch_transforms_active, _C._is_tracing
    _has_autocast, _is_excluded = torch.is_autocast_cpu_enabled, _C._dispatch_tls_is_dispatch_key_excluded
    _AUTOGRAD = _C.DispatchKey.AutogradOther  # excluded with autograd's other keys; stored, as reading it takes 2 us
    _is_functional = torch._is_functional_tensor

    def _is_ordinary_thread():
        return not (_count_dispatch_modes() or _has_transforms() or _is_traced() or _has_autocast()
                    or _is_excluded(_AUTOGRAD) or count_maps())

    def _is_ordinary(t):  # a CPU tensor without memory passes, and fails later for lack of an address
        return t.is_cpu and not t.is_neg() and not t._is_zerotensor() and not _is_functional(t)
