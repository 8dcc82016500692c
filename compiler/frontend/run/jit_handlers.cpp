// jit_handlers.cpp -- default handlers, and checks of handlers and of C functions that are called by name.
#include "frontend/run/jit_handlers.h"

#include "diagnostics/error.h"
#include "frontend/language/extern_function.h"
#include "frontend/language/func.h"
#include "ir/build.h"

namespace retrograde {

void frontend::check_allocator(bool allocates, bool frees) {
  if (allocates == frees) return;
  user_error("set a custom allocator", "allocation and release come together",
             allocates ? "no function to free was given" : "no function to allocate was given",
             "Give both, or neither");
}

JITExtern::JITExtern(Pipeline pipeline) : pipeline_(std::move(pipeline)) {
  if (pipeline_.defined()) return;
  user_error("call a Pipeline by name", "it needs outputs", "it was constructed without any",
             "Construct it: Pipeline p(f)");
}
JITExtern::JITExtern(const Func& func) : JITExtern(Pipeline(func)) {}

Expr frontend::checked_extern_call(const std::string& function, Type result,
                                   const std::vector<Type>& types, const std::vector<Expr>& args,
                                   bool is_pure) {
  const std::string asked = "call the C function " + quoted(function);
  for (size_t i = 0; i < args.size(); i++) {
    if (!args[i].defined())
      user_error(asked, "every argument is a defined expression", "one was never assigned",
                 "Assign every Expr before it is used");
    if (args[i].type() == types[i]) continue;
    user_error(asked, "its arguments have the types that it was declared with",
               text("argument ", i + 1, " is of type ", to_string(args[i].type()), ", not ",
                    to_string(types[i])),
               "Cast it");
  }
  return call_extern(function, result, args, is_pure);
}

}  // namespace retrograde
