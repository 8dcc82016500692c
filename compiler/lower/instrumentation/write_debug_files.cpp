// write_debug_files -- write the values of Funcs to files, for Func::debug_to_file.
// In:  Loops; names unique.
// Out: Loops; after a Func is produced, its memory is written to a file.
//
//   produce f { P }   =>   produce f { P }  assert(debug_to_file("f.tmp", buffer of f) == 0)
//
// Errors: Tuples; file names without a known format; types that the format does not support.
// Source: Halide's documentation of debug_to_file. Tests:
//         test/golden/pipeline/write_debug_files/, test/unit/lower/debug_file_test.cpp.
#include "lower/instrumentation/write_debug_files.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/extern_stage.h"
#include "lower/runtime_call.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

void check(const LoopedFunc& f) {
  const std::string asked =
      text("write ", quoted(f.name()), " to the file ", quoted(f.func->debug_file));
  if (f.func->types.size() != 1) {
    unsupported(asked, "a file holds one value of each point",
                text(quoted(f.name()), " has ", f.func->types.size()),
                "Write a Func that is one element of the Tuple");
  }
  const std::string& path = f.func->debug_file;
  if (!ends_with(path, ".tmp") && !ends_with(path, ".npy")) {
    unsupported(asked, "the name's end says in which format", "it is neither .tmp nor .npy",
                "End it in .npy, which NumPy reads");
  }
  const Type type = f.func->types[0];
  const bool is_known =
      !type.is_handle() && !type.is_bfloat() && !(type.is_float() && type.bits() == 16);
  if (is_known) return;
  unsupported(asked, "its format has the type of the elements",
              text("they are of type ", to_string(type)),
              "Cast them to float in a Func of its own");
}

Stmt write(const LoopedFunc& f, const std::string& name, int number) {
  std::vector<Range> region;
  std::vector<Expr> first, strides;
  for (int d = 0; d < f.func->dimensions(); d++) {
    region.push_back(metadata_range(name, d));
    first.push_back(region.back().min);
    strides.push_back(metadata(name, Metadata::Stride, d));
  }
  const Type type = f.func->types[0];
  const Expr host =
      call_op(Op::address_of, Handle(), {call_func(name, type, first, 0, SymbolRef(f.func))});
  return checked_call(
      text(name, ".written.", number),
      call_runtime("retrograde_debug_to_file",
                   {Expr(f.func->debug_file), packed_buffer(type, host, region, strides)}));
}

}  // namespace

Stmt write_debug_files(const Stmt& all, const Program& program) {
  const bool any = std::any_of(program.funcs.begin(), program.funcs.end(),
                               [](const LoopedFunc& f) { return !f.func->debug_file.empty(); });
  if (!any) return all;
  int written = 0;
  return rewrite_statements(all, [&](const Stmt& s, auto& rewriter) {
    const ProducerConsumer* n = s.as<ProducerConsumer>();
    const LoopedFunc* f = n && n->produces ? program.find(n->name) : nullptr;
    if (!f || f->func->debug_file.empty()) return rewriter.children(s);
    check(*f);
    const Stmt inner = rewriter.children(s);
    return make_block({inner, write(*f, n->name, written++)});
  });
}

}  // namespace retrograde::lower
