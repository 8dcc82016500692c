// extern_argument.cpp -- checks and definition of extern stages, which a C function computes.
#include "frontend/language/extern_argument.h"

#include "frontend/language/func.h"
#include "graph/definitions/define.h"
#include "graph/definitions/definition_rules.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde {

ExternFuncArgument::ExternFuncArgument(graph::FuncPtr func) : defined_(true) {
  contents.kind = graph::ExternArgument::Kind::Func;
  contents.func = std::move(func);
}

ExternFuncArgument::ExternFuncArgument(Expr e) : defined_(true) {
  contents.kind = graph::ExternArgument::Kind::Expr;
  contents.expr = std::move(e);
}

ExternFuncArgument::ExternFuncArgument(std::shared_ptr<graph::ParameterContents> image)
    : defined_(true) {
  contents.kind = graph::ExternArgument::Kind::Buffer;
  contents.buffer = std::move(image);
}

void Func::define_extern(const std::string& function_name,
                         const std::vector<ExternFuncArgument>& args,
                         const std::vector<Type>& types, int dimensionality, NameMangling mangling,
                         DeviceAPI device) {
  const auto arguments = ir::numbered(dimensionality, [&](int d) { return Var::implicit(d); });
  define_extern(function_name, args, types, arguments, mangling, device);
}

void Func::define_extern(const std::string& function_name,
                         const std::vector<ExternFuncArgument>& args,
                         const std::vector<Type>& types, const std::vector<Var>& arguments,
                         NameMangling mangling, DeviceAPI device) {
  const std::string asked =
      text("define ", quoted(name()), " by the C function ", quoted(function_name));
  if (device != DeviceAPI::Host && device != DeviceAPI::None) {
    unsupported(asked, "extern stages run on the CPU", "another device was named",
                "Leave the device out");
  }
  graph::ExternDefinition definition;
  definition.function = function_name;
  definition.mangling = mangling;
  for (const ExternFuncArgument& arg : args) {
    if (!arg.defined())
      user_error(asked, "every argument is a Func, an image or an Expr", "one is undefined",
                 "Give each a value");
    definition.args.push_back(arg.contents);
  }
  const auto variables = ir::mapped(arguments, [&](const Var& var) { return var.name(); });
  graph::define_extern(func_, std::move(definition), types, variables, asked);
}

const std::string& Func::extern_function_name() const {
  if (!is_extern()) {
    user_error("take the name of the C function of " + quoted(name()),
               "a Func that define_extern defines has one",
               "its values are expressions, or none yet", "Ask is_extern() first");
  }
  return func_->extern_definition->function;
}

namespace graph {

// Checks: 1. `f` has no definition yet. 2. There is a name, and a type. 3. The variables differ. 4. Func arguments are
// defined. 5. Exprs are scalars over parameters.
void define_extern(const FuncPtr& f, ExternDefinition definition, const std::vector<Type>& types,
                   const std::vector<std::string>& variables, const std::string& asked) {
  if (f->is_defined())
    user_error(asked, "a Func is defined once", "it has a definition already", "Use a new Func");
  if (definition.function.empty())
    user_error(asked, "the C function has a name", "it is empty", "Give the name of its symbol");
  if (types.empty())
    user_error(asked, "it has at least one value", "no type was given",
               "Give the types of its values");
  for (size_t i = 0; i < variables.size(); i++) {
    for (size_t j = 0; j < i; j++) {
      if (variables[i] != variables[j]) continue;
      user_error(asked, "its arguments are different Vars", quoted(variables[i]) + " appears twice",
                 "Use a Var of its own for each dimension");
    }
  }
  for (const ExternArgument& arg : definition.args) {
    if (arg.kind == ExternArgument::Kind::Func) {
      if (!arg.func->is_defined()) {
        user_error(asked, "every Func among the arguments has a definition",
                   quoted(arg.func->name) + " has none", "Define it first");
      }
      arg.func->frozen = true;
    } else if (arg.kind == ExternArgument::Kind::Expr) {
      if (!arg.expr.defined())
        user_error(asked, "every argument is a defined expression", "one was never assigned",
                   "Assign every Expr before it is used");
      check_over_parameters(arg.expr, "an argument", asked);
    }
  }
  f->args = variables;
  f->types = types;
  Definition pure;
  pure.args = variables_of(variables);
  f->pure = std::move(pure);
  f->schedule.storage_dims = variables;
  f->extern_definition = std::move(definition);
  f->pure->schedule.dims = first_loops(*f, *f->pure);
  make_outputs(*f);
  f->version++;
}

}  // namespace graph
}  // namespace retrograde
