// Emits the entry points that exports.h describes.
#pragma once

#include "codegen/cpu/exports.h"
#include "codegen/emitter.h"

namespace retrograde::codegen {
void make_export(Emitter& emitter, const Export& e, llvm::Function* body);
void make_dispatch(Emitter& emitter, const Dispatch& dispatch);
}  // namespace retrograde::codegen
